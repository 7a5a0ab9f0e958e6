"""Gates, and the transfer that they let on: rules by hand, bit-equal resume, a policy carried."""

import dataclasses
import json
import math

import numpy as np
import pytest
from natural_puck import EXPERT, LENGTH, PUCK, Barren, Reach, puck

from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.evolution.evolution import Evolution
from revolver_lab.gates import (
    PILOT_GATE,
    PUBLISHED_GATE,
    EvaluatedGate,
    Gate,
    Position,
    SampledGate,
    gate_from_json,
)
from revolver_lab.learners.natural.npg import NPG
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.methods import Member
from revolver_lab.natural_loop import NaturalTransfer
from revolver_lab.natural_methods import NaturalMethod
from revolver_lab.natural_population import NaturalPopulation
from revolver_lab.natural_transfer import natural_transfer
from revolver_lab.policies import Policy
from revolver_lab.tasks.base import Task
from revolver_lab.trajectories import Success

TINY = NaturalSettings(trajectories=16, length=LENGTH, value_hidden=(16,), warm_batches=2,
                       gamma=0.97, value_batch=64)  # fmt: skip
QUICK = SampledGate(alpha_step=0.1, xi=0.15, finish_episodes=20)


@pytest.fixture(scope="module")
def evolve():
    return puck()


def never(alpha, episodes):
    raise AssertionError("no evaluation was due")


def test_the_sampled_gate_is_its_formula():
    gate = SampledGate(alpha_step=0.02, low=0.5, high=0.9, weight=0.3, slack=0.1)
    rng, position, average = np.random.default_rng(0), gate.begin(), None
    for success in rng.random(100):
        before = position.alpha
        average = success if average is None else 0.7 * average + 0.3 * success
        trust = np.clip((min(average, success + 0.1) - 0.5) / 0.4, 0, 1)
        position = gate.after(position, success, never)
        assert position.alpha == pytest.approx(min(before + 0.02 * trust, 1.0))
        assert position.average == pytest.approx(average)
    assert 0 < position.alpha < 1


def test_good_policies_go_at_full_speed_and_bad_ones_wait():
    fast, slow = SampledGate(alpha_step=0.03), Position(alpha=0.5)
    position = fast.begin()
    for _ in range(34):
        position = fast.after(position, 1.0, never)
    assert position.alpha == 1.0  # 33.3 steps of 0.03
    for _ in range(10):
        slow = fast.after(slow, 0.4, never)
    assert slow.alpha == 0.5


def test_the_sampled_gate_ends_only_when_an_evaluation_agrees():
    gate, asked = SampledGate(every=2, finish=0.9, finish_episodes=50), []

    def measure(alpha, episodes):
        asked.append((alpha, episodes))
        return 0.8 if len(asked) == 1 else 0.9

    position = Position(alpha=1.0, average=0.9)
    while not position.done:
        position = gate.after(position, 0.9, measure)
    assert asked == [(1.0, 50), (1.0, 50)]
    assert position.iterations == 4


def test_an_end_that_has_to_be_confirmed_takes_a_second_evaluation():
    gate = SampledGate(every=1, finish=0.98, finish_episodes=50, confirm_episodes=150)
    answers, asked = iter([0.96, 1.0, 0.94, 0.98, 0.96]), []

    def measure(alpha, episodes):
        asked.append((alpha, episodes))
        return next(answers)

    position, ends = Position(alpha=1.0, average=0.9), []
    for _ in range(3):
        position = gate.after(position, 0.9, measure)
        ends.append(position.done)
    assert ends == [False, False, True]
    assert asked == [(1.0, 50), (1.0, 50), (1.0, 150), (1.0, 50), (1.0, 150)]
    assert "confirm" not in SampledGate().to_json()  # recorded folders keep their names
    assert gate_from_json(gate.to_json()) == gate


def test_the_last_evaluation_is_a_fresh_one_whatever_the_gate_asked_for_before():
    home = PUCK.format(mass=1, old=5, new=0.001, damping=1)
    gate = SampledGate(alpha_start=1.0, every=1, finish=0.0, finish_episodes=7, high=0.01, low=0.0)
    method = NaturalMethod(name="m", gate=gate, settings=TINY)
    members = [Member(method=method, seed=seed) for seed in (0, 1)]
    some = NaturalPopulation(Evolution(home, home), members, expert=EXPERT, steps=100_000,
                             task=Reach(), evaluate_episodes=7)  # fmt: skip
    assert some.run()
    for log in some.results():
        assert [len(trial.returns) for trial in log.trials[-2:]] == [7, 7]
        assert log.finished
        assert log.trials[-1].returns != log.trials[-2].returns
    assert some.run()  # again does nothing
    assert [len(log.trials) for log in some.results()] == [
        len(loop.trials) for loop in some.loops]  # fmt: skip


def test_the_published_gate_asks_every_five_iterations_and_moves_at_one_half():
    gate, asked = EvaluatedGate(alpha_step=0.5), []
    answers = iter([0.45, 0.5, 1.0, 0.88, 0.9])

    def measure(alpha, episodes):
        asked.append((alpha, episodes))
        return next(answers)

    position, alphas = gate.begin(), []
    while not position.done:
        position = gate.after(position, 0.0, measure)
        alphas.append(position.alpha)
    assert asked == [(0.0, 20), (0.0, 20), (0.5, 20), (1.0, 50), (1.0, 50)]
    assert alphas == [0.0] * 9 + [0.5] * 5 + [1.0] * 11


@pytest.mark.parametrize("gate", [PILOT_GATE, PUBLISHED_GATE, QUICK])
def test_gates_travel_as_json(gate):
    assert gate_from_json(json.loads(json.dumps(gate.to_json()))) == gate


def test_beta_is_drawn_from_the_window_and_not_beyond_the_target():
    gate, rng = SampledGate(xi=0.2), np.random.default_rng(0)
    drawn = np.array([gate.draw(0.9, rng) for _ in range(200)])
    assert drawn.min() >= 0.9
    assert 0.99 < drawn.max() <= 1.0
    assert SampledGate(xi=0.0).draw(0.3, rng) == 0.3


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        (SampledGate, {"alpha_step": 0.0}), (SampledGate, {"xi": -0.1}),
        (SampledGate, {"low": 0.9, "high": 0.9}), (SampledGate, {"weight": 0}),
        (EvaluatedGate, {"every": 0}), (EvaluatedGate, {"episodes": 2.5}),
        (EvaluatedGate, {"threshold": math.nan}), (SampledGate, {"grid": 1}),
        (Gate, {"alpha_start": 2}),
    ],
)  # fmt: skip
def test_gates_that_cannot_work_are_refused(kind, changes):
    with pytest.raises(SettingsError, match=next(iter(changes))):
        kind(**changes)
    with pytest.raises(SettingsError, match="SampledGate"):
        gate_from_json({"gate": "Open"})


def test_a_policy_is_carried_to_a_robot_on_which_it_failed(evolve, tmp_path):
    log = natural_transfer(EXPERT, evolve, QUICK, settings=TINY, task=Reach(), steps=150_000,
                           evaluate_episodes=40, nthread=1, out=tmp_path)  # fmt: skip
    zero_shot = NaturalTransfer(EXPERT, evolve, QUICK, settings=TINY, task=Reach(), nthread=1)
    assert zero_shot.examine(0.0, 40).success > 0.9
    assert zero_shot.examine(1.0, 40).success < 0.1
    assert log.finished
    assert log.reached_target
    assert log.success >= 0.9
    assert not log.failure
    alphas = [i.alpha for i in log.iterations]
    assert alphas == sorted(alphas)
    assert alphas[0] == 0
    assert alphas[-1] == 1
    assert list(log.alphas) == sorted(set(alphas))
    assert sum(phase.episodes for phase in log.phases) == 16 * len(log.iterations)
    assert log.steps == (len(log.iterations) + 2) * 16 * LENGTH
    for i in log.iterations:
        assert i.alpha - 5e-4 <= i.mean_beta <= min(i.alpha + QUICK.xi, 1)
    saved = json.loads((tmp_path / "log.json").read_text())
    assert saved["iterations"][3] == dataclasses.asdict(log.iterations[3])
    assert saved["settings"]["gate"]["gate"] == "SampledGate"
    assert (tmp_path / "iterations.csv").read_text().count("\n") == len(log.iterations) + 1
    again = Policy.load(tmp_path / "policy.safetensors")
    assert again.card.algorithm == "NPG"
    seen = np.ones((3, 2), np.float32)
    assert np.array_equal(again(seen), log.policy(seen))


def test_a_budget_ends_what_a_gate_would_not(evolve):
    log = natural_transfer(EXPERT, evolve, SampledGate(alpha_start=1.0), settings=TINY,
                           task=Barren(), steps=3000, evaluate_episodes=5, nthread=1)  # fmt: skip
    assert 3000 <= log.steps < 3000 + 16 * LENGTH
    assert not log.finished
    assert all(i.alpha == 1 and i.kl == 0 for i in log.iterations)
    seen = np.ones((3, 2), np.float32)
    assert np.allclose(log.policy(seen), EXPERT(seen))


def journey(evolve, seed=4):
    gate = EvaluatedGate(alpha_step=0.2, xi=0.2, every=2, episodes=12, shaping=0.5)
    return NaturalTransfer(EXPERT, evolve, gate, settings=TINY, task=Reach(), seed=seed,
                           steps=8000, nthread=1)  # fmt: skip


def test_a_resumed_transfer_is_the_one_that_was_never_stopped(evolve):
    whole, half, rest = journey(evolve), journey(evolve), journey(evolve, seed=9)
    assert whole.run()
    asked = iter([False] * 7 + [True])
    assert not half.run(pause=lambda: next(asked))
    arrays, plain = half.state()
    rest.seed = 4
    rest.restore(arrays, json.loads(json.dumps(plain)))
    assert rest.run()

    def timeless(records):
        return [dataclasses.replace(r, wall_time=0.0) for r in records]

    assert timeless(rest.iterations) == timeless(whole.iterations)
    assert rest.trials == whole.trials
    ours, theirs = rest.result().policy.weights, whole.result().policy.weights
    assert all(np.array_equal(v, theirs[k]) for k, v in ours.items())
    assert len(whole.iterations) > 10


def test_the_number_of_threads_changes_nothing(evolve):
    logs = [
        natural_transfer(EXPERT, evolve, QUICK, settings=TINY, task=Reach(), steps=2000,
                         evaluate_episodes=5, nthread=threads)
        for threads in (1, 2)
    ]  # fmt: skip
    ours, theirs = (log.policy.weights for log in logs)
    assert all(np.array_equal(v, theirs[k]) for k, v in ours.items())


def test_robots_are_those_of_the_grid_unless_each_is_to_be_its_own(evolve):
    for grid in (True, False):
        loop = NaturalTransfer(EXPERT, evolve, dataclasses.replace(QUICK, grid=grid), settings=TINY,
                               task=Reach(), nthread=1)  # fmt: skip
        loop.iterate()
        betas = loop.env.alphas * 1000
        assert (np.abs(betas - betas.round()) < 1e-9).all() == grid
        assert len(np.unique(betas)) > 8


def test_evaluations_are_fresh_and_act_by_the_mean(evolve):
    loop = journey(evolve)
    first, second = (loop.examine(0.0, 12) for _ in range(2))
    assert len(first.returns) == len(first.successes) == 12
    assert first.returns != second.returns
    assert journey(evolve).examine(0.0, 12) == first


def test_numbers_that_break_stop_the_transfer_and_keep_the_policy(evolve, monkeypatch):
    loop = journey(evolve)
    loop.iterate()
    before = loop.learner.policy()
    monkeypatch.setattr(NPG, "_advantages", lambda self, batch, *_: np.full(batch.steps, np.nan))
    assert loop.run()
    assert "finite" in loop.result().failure
    after = loop.result().policy
    assert all(np.array_equal(v, after.weights[k]) for k, v in before.weights.items())


def test_what_cannot_work_is_refused_before_the_first_step(evolve):
    class Aimless(Task):
        """A task without a goal."""

        episode_steps = LENGTH

        def bind(self, model):
            super().bind(model)
            self.observation_size = 2

        def observe(self, robot):
            return np.concatenate([robot.qpos, robot.qvel], axis=1)

        def initial_state(self, model, rng):
            return np.zeros(1), np.zeros(1)

        def reward(self, robot, before):
            return robot.qvel[:, 0].copy()

    with pytest.raises(SettingsError, match="least_return"):
        NaturalTransfer(None, evolve, QUICK, settings=TINY, task=Aimless())
    loop = NaturalTransfer(None, evolve, QUICK, settings=TINY, task=Aimless(),
                           success=Success(least_return=-100.0))  # fmt: skip
    assert loop.examine(0.0, 3).success == 1
    with pytest.raises(SettingsError, match="steps = 0"):
        NaturalTransfer(None, evolve, QUICK, settings=TINY, task=Reach(), steps=0)
    with pytest.raises(SettingsError, match="evaluate_episodes = -1"):
        natural_transfer(None, evolve, settings=TINY, task=Reach(), evaluate_episodes=-1)
    other = Policy(weights={"actor.0.weight": np.zeros((2, 3)), "actor.0.bias": np.zeros(2)},
                   head="gaussian")  # fmt: skip
    with pytest.raises(PolicyFileError, match="3 observations"):
        NaturalTransfer(other, evolve, QUICK, settings=TINY, task=Reach())
