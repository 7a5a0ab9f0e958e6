"""When gates open and learners end, and that every step played is counted."""

import dataclasses
import math

import numpy as np
import pytest
from natural_puck import LENGTH, Reach, feedback, puck

from revolver_lab.gates import EvaluatedGate, Position, SampledGate
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.natural_loop import NaturalTransfer

TINY = NaturalSettings(trajectories=16, length=LENGTH, value_hidden=(16,), warm_batches=2,
                       gamma=0.97, value_batch=64)  # fmt: skip


@pytest.fixture(scope="module")
def evolve():
    return puck()


def never(alpha, episodes):
    raise AssertionError("no evaluation was due")


def test_nothing_is_evaluated_on_the_target_before_an_iteration_was_made_there():
    gate = SampledGate(every=1, alpha_step=0.1)
    position = gate.after(Position(alpha=0.98, average=1.0, iterations=9), 1.0, never)
    assert (position.alpha, position.done) == (1.0, False)


def test_a_success_exactly_as_high_as_asked_is_enough_for_the_end():
    gate = SampledGate(every=1, finish=0.9, confirm_episodes=100, confirm=0.95, high=0.8)
    answers = iter([0.9, 0.95])
    position = Position(alpha=1.0, average=0.8)
    assert gate.after(position, 0.8, lambda alpha, episodes: next(answers)).done


def test_the_published_gate_tells_the_last_success_for_an_average():
    position = EvaluatedGate().after(Position(average=0.2), 0.7, never)
    assert position.average == 0.7


def test_an_evaluation_is_the_same_however_noisy_the_policy_is(evolve):
    found = []
    for log_std in (-2.5, 1.0):
        loop = NaturalTransfer(feedback([-2.0, -1.5], log_std), evolve, EvaluatedGate(),
                               settings=TINY, task=Reach(), seed=4, nthread=1)  # fmt: skip
        found.append(loop.examine(0.0, 12))
    assert found[0] == found[1]
    assert found[0].success == 1


def test_the_shaping_of_the_gate_is_what_the_learner_trains_on(evolve):
    settings = dataclasses.replace(TINY, warm_batches=0, bootstrap=False)
    plain, shaped = (
        NaturalTransfer(feedback([-2.0, -1.5]), evolve, EvaluatedGate(shaping=h, alpha_start=0.5),
                        settings=settings, task=Reach(), seed=4, nthread=1)
        for h in (0.0, 2.0)
    )  # fmt: skip
    reports = plain.iterate(), shaped.iterate()
    ours, theirs = (loop.learner.value.state()[0] for loop in (plain, shaped))
    weights = np.exp(2 * ours["last_x"][:, -1])  # of beta, the last that the value net sees
    assert ours["last_y"].any()
    np.testing.assert_allclose(theirs["last_y"][:, 0], weights * ours["last_y"][:, 0], rtol=1e-5)
    assert reports[0].episode_return == reports[1].episode_return  # logged as earned


def test_every_trial_is_counted_and_tells_when_it_was_made(evolve):
    gate = EvaluatedGate(alpha_step=0.5, every=2, episodes=12, finish_episodes=15)
    loop = NaturalTransfer(feedback([-2.0, -1.5]), evolve, gate, settings=TINY, task=Reach(),
                           seed=4, steps=3000, nthread=1)  # fmt: skip
    loop.run()
    log, steps = loop.result(), [0, *(i.steps for i in loop.iterations)]
    assert [trial.iteration for trial in log.trials] == [*range(2, len(steps), 2)]
    assert {0.0, 0.5} <= {trial.alpha for trial in log.trials}
    assert [trial.steps for trial in log.trials] == steps[2::2]
    tens = [math.ceil(len(trial.returns) / 10) for trial in log.trials]  # are played side by side
    assert log.evaluation_steps == LENGTH * 10 * sum(tens)
    assert all(len(t.returns) == (15 if t.alpha == 1.0 else 12) for t in log.trials)
    assert log.success == log.trials[-1].success
    assert log.policy.card.episode_return == np.mean(log.trials[-1].returns)
    for phase in log.phases:
        those = [i for i in log.iterations if i.alpha == phase.alpha]
        assert len(those) >= 2
        assert (phase.episodes, phase.steps) == (16 * len(those), those[-1].steps)
        assert phase.episode_return == those[-1].episode_return


def test_a_target_that_was_allowed_but_never_trained_on_was_not_reached(evolve):
    gate = SampledGate(alpha_step=1.0, low=0.0, high=0.01)
    loop = NaturalTransfer(feedback([-2.0, -1.5]), evolve, gate, settings=TINY, task=Reach(),
                           seed=4, nthread=1)  # fmt: skip
    loop.iterate()
    assert loop.position.alpha == 1.0
    assert not loop.result().reached_target
    loop.iterate()
    assert loop.result().reached_target


def test_a_resumed_transfer_goes_on_counting_its_seconds(evolve):
    first, rest = (
        NaturalTransfer(feedback([-2.0, -1.5]), evolve, settings=TINY, task=Reach(), nthread=1)
        for _ in range(2)
    )
    arrays, plain = first.state()
    rest.restore(arrays, plain | {"seconds": 1000.0})
    assert 1000 <= rest.seconds < 1060
