"""Gates of equal jumps, of their own or of another one's kind: alpha goes as far as it says."""

import pytest

from revolver_lab.gates import EvaluatedGate, Position, SampledGate, SteppedGate
from revolver_lab.natural_methods import NATURAL_METHODS
from revolver_lab.runs.sweep_file import plans_of

KINDS = [SteppedGate, SampledGate, EvaluatedGate]


def path(gate):
    """Alpha after each jump, up to 1, of a policy that always succeeds."""
    position, found = gate.begin(), []
    while position.alpha < 1:
        position = gate.after(position, 1.0, lambda alpha, episodes: 1.0)
        found.append(position.alpha)
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_jumps_of_one_nth_are_n_jumps_and_end_at_exactly_1(kind):
    for n in [*range(1, 101), 333, 999, 1999]:
        found = path(kind(alpha_step=1 / n, every=1))
        assert len(found) == n
        assert found[-1] == 1.0
        assert found == pytest.approx([(k + 1) / n for k in range(n)], abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_path_that_is_nearly_over_is_not_over(kind):
    gate = kind(alpha_step=1e-4, every=1)
    position = gate.after(Position(alpha=1 - 2e-4, average=1.0), 1.0, lambda *_: 1.0)
    assert position.alpha == pytest.approx(1 - 1e-4, abs=1e-12)
    assert position.alpha < 1


def gate_of(like, **gate):
    sweep = {"robots": ["adroit-door"], "methods": ["own"], "seeds": [0],
             "method": {"own": {"like": like, "gate": gate}}}  # fmt: skip
    return plans_of(sweep)[0].methods[0].gate


def test_a_gate_of_another_kind_keeps_what_both_kinds_say():
    direct = gate_of("npg-direct", kind="EvaluatedGate")
    assert isinstance(direct, EvaluatedGate)
    assert direct.alpha_start == 1.0  # it stays on the target
    quiet = NATURAL_METHODS["quiet-confirmed"].gate
    for kind in (SteppedGate, EvaluatedGate):
        found = gate_of("quiet-confirmed", kind=kind.__name__, alpha_step=0.25)
        assert type(found) is kind
        assert (found.alpha_step, found.xi, found.finish) == (0.25, 0.02, quiet.finish)
        if isinstance(found, SampledGate):
            assert (found.low, found.high, found.confirm_episodes) == (0.3, 0.7, 150)
    assert gate_of("gate-evaluated-0.05", kind="SampledGate") == SampledGate(
        alpha_step=0.05, finish=EvaluatedGate.finish
    )
