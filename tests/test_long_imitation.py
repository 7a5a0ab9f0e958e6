"""A teacher whose weight has all but faded still moves the policy by the step asked for."""

import dataclasses

import numpy as np
import pytest

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.learners.natural.dapg import DAPG
from revolver_lab.learners.natural.imitating import imitation_weight
from revolver_lab.learners.natural.settings import PILOT
from revolver_lab.trajectories import Trajectories

SEEN, A, N, T = 4, 3, 8, 25


def improved(iteration, settings=PILOT, rewarded=False):
    """The actor before and after an update at some iteration, and its KL."""
    rng = np.random.default_rng(0)
    teacher = Demonstrations(
        lengths=[200], observations=rng.standard_normal((200, SEEN)), rewards=np.zeros(200),
        actions=np.clip(rng.standard_normal((200, A)), -1, 1),
        next_observations=rng.standard_normal((200, SEEN)),
    )  # fmt: skip
    batch = Trajectories(
        observations=rng.standard_normal((T + 1, N, SEEN)).astype(np.float32),
        actions=rng.standard_normal((T, N, A)).astype(np.float32), rewards=np.zeros((T, N)),
        lengths=np.full(N, T), terminated=np.zeros(N, bool), betas=np.zeros(N),
        goal_steps=np.zeros(N, int),
    )  # fmt: skip
    learner = DAPG(SEEN, A, settings, demonstrations=teacher, seed=0)
    learner.iterations, before = iteration, learner.actor.flat.copy()
    advantages = rng.standard_normal(N * T) if rewarded else np.zeros(N * T)
    kl, finite = learner._improve(batch, advantages)
    assert finite
    return learner.actor.flat - before, kl


@pytest.mark.parametrize("iteration", [100, 1290, 1700, 1770, 1800, 1900, 2500, 20_000])
def test_a_step_by_demonstrations_alone_is_the_same_whatever_they_weigh(iteration):
    # F^-1 g / sqrt(g^T F^-1 g): a factor on g cancels, so the first step is the answer to all.
    expected, kl = improved(0)
    moved, found = improved(iteration)
    assert found == pytest.approx(kl, rel=0.01)
    assert found == pytest.approx(PILOT.step_size / 2, rel=0.1)
    assert np.abs(moved - expected).max() < 0.02 * np.abs(expected).max()


def test_demonstrations_that_weigh_nothing_move_nothing():
    for changes in ({"imitation_weight": 0.0}, {"imitation_decay": 0.0}):
        settings = dataclasses.replace(PILOT, **changes)
        assert imitation_weight(settings, 1, np.zeros(3)) == 0
        assert not improved(1, settings)[0].any()


def test_the_weight_is_the_papers_wherever_it_can_be_computed_with():
    for k in range(1290):
        assert imitation_weight(PILOT, k, np.zeros(2)) == 0.1 * 0.95**k
    for k in range(2000):  # beside what was earned, it may fade to nothing
        assert imitation_weight(PILOT, k, np.array([-1.0, 2.0])) == 0.1 * 0.95**k * 2.0
    assert np.array_equal(improved(1900, rewarded=True)[0], improved(3000, rewarded=True)[0])
