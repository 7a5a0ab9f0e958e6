"""A policy that is made can act, in any way that it may be asked to; what cannot is refused."""

import itertools

import numpy as np
import pytest

from revolver_lab.errors import PolicyFileError, RevolverError
from revolver_lab.learners.natural.actor import Actor
from revolver_lab.policies import Policy

SEEN, WIDTH, A = 3, 4, 2
LAYERS = {
    "actor.0.weight": np.ones((WIDTH, SEEN)), "actor.0.bias": np.zeros(WIDTH),
    "actor.1.weight": np.ones((A, WIDTH)), "actor.1.bias": np.zeros(A),
}  # fmt: skip
PARTS = {
    "actor.input_shift": (SEEN,), "actor.input_scale": (SEEN,), "actor.output_shift": (A,),
    "actor.output_scale": (A,), "actor.log_std": (A,), "actor.log_std.weight": (A, WIDTH),
    "actor.log_std.bias": (A,),
}  # fmt: skip
PAIRS = [("actor.input_shift", "actor.input_scale"), ("actor.output_shift", "actor.output_scale"),
         ("actor.log_std.weight", "actor.log_std.bias")]  # fmt: skip


def acts(policy):
    """Whether it maps observations to actions, by itself and as the learner's actor."""
    rng, seen = np.random.default_rng(0), np.ones((5, SEEN))
    found = [policy(seen), policy(seen, deterministic=False, rng=rng)]
    if Actor.takes(policy):
        actor = Actor.of(policy, 0.0, np.float64)
        assert np.array_equal(actor.log_std, policy.weights.get("actor.log_std", np.zeros(A)))
        found.append(np.clip(actor.mean(seen), -1, 1))
    return all(x.shape == (5, A) and np.isfinite(x).all() for x in found)


@pytest.mark.parametrize("head", ["gaussian", "tanh", "squashed_gaussian"])
def test_of_all_sets_of_parts_those_that_are_taken_can_act_and_the_others_lack_a_partner(head):
    taken = 0
    for some in itertools.chain.from_iterable(
        itertools.combinations(PARTS, count) for count in range(len(PARTS) + 1)
    ):
        weights = {**LAYERS, **{name: np.full(PARTS[name], 0.5) for name in some}}
        paired = all((one in some) == (other in some) for one, other in PAIRS)
        spread = {"actor.log_std", "actor.log_std.weight"} & {*some}
        try:
            policy = Policy(weights=weights, head=head)
        except PolicyFileError:
            assert not paired or (head == "squashed_gaussian" and not spread)
            continue
        assert paired
        assert acts(policy)
        taken += 1
    assert taken == (16 if head != "squashed_gaussian" else 12)


@pytest.mark.parametrize("name", PARTS)
def test_parts_of_another_shape_are_refused_by_name(name):
    whole = {**LAYERS, **{part: np.full(shape, 0.5) for part, shape in PARTS.items()}}
    assert acts(Policy(weights=whole, head="gaussian"))
    for shape in ((), (1,), (7,), (1, 1), (7, 7), (*PARTS[name], 1), PARTS[name][::-1] * 2):
        with pytest.raises(PolicyFileError, match=name.replace(".", "[.]")):
            Policy(weights={**whole, name: np.full(shape, 0.5)}, head="gaussian")


@pytest.mark.parametrize("side", ["input", "output"])
def test_a_scale_of_zero_is_refused(side):
    whole = {**LAYERS, **{part: np.full(shape, 0.5) for part, shape in PARTS.items()}}
    scale = whole[f"actor.{side}_scale"].copy()
    scale[1] = 0
    with pytest.raises(PolicyFileError, match=f"zeros in actor.{side}_scale"):
        Policy(weights={**whole, f"actor.{side}_scale": scale}, head="gaussian")


@pytest.mark.parametrize("first", [np.ones(()), np.ones(3), np.ones((2, 3, 1)), [[1.0]], None, "x"])
def test_a_first_layer_that_is_no_matrix_of_floats_is_refused_in_our_words(first):
    with pytest.raises(RevolverError, match="Allowed"):
        Policy(weights={"actor.0.weight": first, "actor.0.bias": np.zeros(1)}, head="tanh")
