"""A card's return was measured on the robot it names; an evaluation costs what was played."""

import pytest
import small_runs
import test_transfer
from natural_puck import EXPERT, LENGTH, Reach, puck
from test_runs_resume import poisoned

from revolver_lab.evaluation import evaluate
from revolver_lab.gates import EvaluatedGate, SampledGate
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.methods import Member
from revolver_lab.natural_loop import NaturalTransfer
from revolver_lab.natural_transfer import natural_transfer
from revolver_lab.population import EVALUATION_SEEDS

STILL = NaturalSettings(trajectories=4, length=LENGTH, value_hidden=(8,), warm_batches=0,
                        step_size=1e-9)  # fmt: skip


class Counted:
    """Counts the environment steps that a task is asked about."""

    def reward(self, robot, before):
        self.counted = getattr(self, "counted", 0) + len(robot.qpos)
        return super().reward(robot, before)


class CountedReach(Counted, Reach):
    """Of a natural learner."""


class CountedPush(Counted, test_transfer.PushRight):
    """Of the others."""


def measured(log, evolve, task):
    """What a log's policy returns on the robot of its card."""
    return evaluate(log.policy, evolve, log.policy.card.alpha, 200, task=task).mean()


def test_a_natural_learner_that_stays_at_home_is_measured_on_the_target_and_says_so():
    evolve = puck()
    gate = SampledGate(alpha_step=1e-9, low=0.98, high=1.0)
    log = natural_transfer(EXPERT, evolve, gate, settings=STILL, steps=200, task=Reach(),
                           evaluate_episodes=200, nthread=1)  # fmt: skip
    assert log.policy.card.alpha == 1.0
    assert log.policy.card.episode_return == pytest.approx(measured(log, evolve, Reach()), abs=0.5)
    home = evaluate(log.policy, evolve, 0.0, 200, task=Reach()).mean()
    assert home > log.policy.card.episode_return + 3  # so that it matters which robot it is
    assert log.alphas[-1] < 0.1  # how far it came is in the log


def test_a_policy_on_its_way_has_the_return_that_its_gate_measured_or_none():
    gate = EvaluatedGate(alpha_step=0.25, every=3, episodes=20, threshold=0.0)
    loop = NaturalTransfer(EXPERT, puck(), gate, settings=STILL, task=Reach(), nthread=1)
    for k in range(1, 8):
        loop.iterate()
        card = loop.result().policy.card
        if k % 3:  # the policy is another than the one that was measured
            assert (card.alpha, card.episode_return) == (loop.position.alpha, None)
        else:
            assert (card.alpha, card.episode_return) == (loop.trials[-1].alpha,
                                                         loop.trials[-1].mean)  # fmt: skip
            assert card.alpha == loop.position.alpha - 0.25


def test_a_learner_that_was_stopped_on_its_way_is_measured_on_the_target_and_says_so():
    evolve = small_runs.puck()
    sick, _ = poisoned(evolve, 1)
    sick.run()
    log = sick.results()[1]
    assert log.failure
    assert log.alphas[-1] < 1
    card = log.policy.card
    again = evaluate(log.policy, evolve, card.alpha, 1, EVALUATION_SEEDS + card.seed,
                     task=test_transfer.PushRight())  # fmt: skip
    assert card.alpha == 1.0
    assert card.episode_return == pytest.approx(again.mean(), abs=1e-9)


@pytest.mark.parametrize("episodes", [1, 3, 10, 11, 25])
def test_the_cost_of_a_natural_learners_evaluations_is_counted_by_the_environment(episodes):
    task = CountedReach()
    gate = EvaluatedGate(every=2, episodes=episodes, threshold=1.0)
    log = natural_transfer(EXPERT, puck(), gate, settings=STILL, steps=400, task=task,
                           evaluate_episodes=episodes, nthread=1)  # fmt: skip
    assert len(log.trials) > 2
    assert {len(trial.returns) for trial in log.trials} == {episodes}
    assert log.steps + log.evaluation_steps == task.counted


@pytest.mark.parametrize("episodes", [1, 32, 33, 70])
def test_the_cost_of_a_populations_evaluations_is_counted_by_the_environment(episodes):
    task = CountedPush()
    one = Member(method=small_runs.DIRECT, seed=0)
    some = small_runs.population(small_runs.puck(), [one], task=task, evaluate_episodes=episodes)
    some.run()
    log = some.results()[0]
    assert len(log.evaluations[0].returns) == episodes
    assert log.evaluation_steps > 0
    trained = CountedPush()
    none = small_runs.population(small_runs.puck(), [one], task=trained, evaluate_episodes=0)
    none.run()
    assert task.counted - trained.counted == log.evaluation_steps
