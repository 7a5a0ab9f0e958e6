"""What the stacked learners do in an update, one number at a time."""

import dataclasses

import numpy as np
import pytest
import torch

from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.learners.stacked.layout import fresh, mlp
from revolver_lab.learners.stacked.learner import ALGORITHMS, StackedLearner
from revolver_lab.learners.stacked.naming import policy_of
from revolver_lab.learners.stacked.replay import StackedReplay
from revolver_lab.methods import METHODS, Member, members

O, A = 5, 2  # noqa: E741
TINY = LearnerSettings(hidden=(16, 16), batch_size=12, learning_rate=1e-3, simulations=3)


def step(learner, seed, beta=0.05):
    """One tick of three simulations a learner: random transitions are stored and learnt from."""
    n = 3 * len(learner.members)
    block = np.random.default_rng(seed).standard_normal((n, 2 * O + 1)).astype(np.float32)
    seen, reward, following = block[:, :O], block[:, O], block[:, O + 1 :]
    everyone = np.ones(n, dtype=bool)
    learner.store(everyone, seen, learner.act(seen), reward, following, ~everyone,
                  np.full(n, beta))  # fmt: skip
    learner.update(np.ones(len(learner.members), dtype=bool))


def test_exploration_adds_noise_of_its_own_size_and_is_clipped():
    settings = dataclasses.replace(TINY, algorithm="TD3", action_noise=0.3, target_noise=0.9)
    algorithm = ALGORITHMS["TD3"](settings, O, A, 2)
    algorithm.actor.flat.normal_()
    seen, noise = torch.randn(2, 50, O), 3 * torch.randn(2, 50, A)
    mean = algorithm.explore(seen, torch.zeros_like(noise))
    expected = np.clip(mean.numpy() + 0.3 * noise.numpy(), -1, 1)
    assert 0.1 < (np.abs(expected) == 1).mean() < 0.9
    np.testing.assert_allclose(algorithm.explore(seen, noise).numpy(), expected, atol=1e-6)


def test_first_weights_are_uniform_within_the_root_of_their_inputs():
    drawn = fresh(mlp([400, 25, 3], norm=False), np.random.default_rng(0))
    for name, inputs in (("0.weight", 400), ("0.bias", 400), ("1.weight", 25), ("1.bias", 25)):
        most = np.abs(drawn[name]).max() * np.sqrt(inputs)
        assert most <= 1
        assert most > 0.99 if drawn[name].size > 1000 else most > 0.3


def test_the_actor_of_td3_moves_at_every_so_many_updates_and_not_between():
    settings = dataclasses.replace(TINY, algorithm="TD3", policy_delay=3, learning_starts=1)
    learner = StackedLearner(settings, O, A, members(["revolver"], [0]), capacity=100)
    learner.enter(0, 0.0)
    seen, last = [], learner.algorithm.actor.flat.clone()
    for k in range(7):
        step(learner, k)
        seen.append(not torch.equal(last, learner.algorithm.actor.flat))
        last = learner.algorithm.actor.flat.clone()
    assert seen == [False, False, True, False, False, True, False]


def test_learning_begins_with_enough_transitions_and_takes_all_its_updates():
    settings = dataclasses.replace(TINY, learning_starts=9, updates=4)
    learner = StackedLearner(settings, O, A, members(["revolver"], [0]), capacity=100)
    learner.enter(0, 0.0)
    counts = []
    for k in range(5):
        step(learner, k)
        counts.append(int(learner.algorithm.critic.adam.count.item()))
    assert counts == [0, 0, 4, 8, 12]  # 3, 6, 9, ... transitions


def test_only_a_learner_without_an_expert_that_has_not_begun_acts_at_random():
    settings = dataclasses.replace(TINY, learning_starts=6, ent_coef=0.01)
    learner = StackedLearner(settings, O, A, members(["scratch", "direct"], [0]), capacity=100)
    expert = policy_of(learner.algorithm, 1)
    quiet = dict(expert.parameters())
    quiet["actor.log_std.weight"] = 0 * quiet["actor.log_std.weight"]
    quiet["actor.log_std.bias"] = 0 * quiet["actor.log_std.bias"] - 20.0
    learner.adopt(1, dataclasses.replace(expert, weights=quiet))
    seen = np.zeros((6, O), np.float32)  # of both learners, three simulations each
    spread = np.array([learner.act(seen).reshape(2, 3, A) for _ in range(200)])
    uniform, still = spread[:, 0].ravel(), spread[:, 1].ravel()
    assert uniform.std() == pytest.approx(2 / np.sqrt(12), rel=0.08)
    assert 0.98 < np.abs(uniform).max() <= 1
    assert still.reshape(-1, A).std(axis=0).max() < 1e-5
    for p in range(2):
        learner.enter(p, 1.0)
    for k in range(2):
        step(learner, k, beta=1.0)
    begun = np.array([learner.act(seen)[:3] for _ in range(200)])
    assert abs((begun**4).mean() - 1 / 5) > 0.01  # as no uniform number between -1 and 1


@pytest.mark.parametrize(("critic", "same"), [("carried", True), ("reset", False)])
def test_an_experts_critic_is_carried_or_left_as_the_method_says(critic, same):
    method = dataclasses.replace(METHODS["direct"], critic=critic)
    learner = StackedLearner(TINY, O, A, [Member(method=method, seed=0)], capacity=100)
    other = StackedLearner(TINY, O, A, members(["direct"], [9]), capacity=100)
    learner.adopt(0, other.policy(0))
    ours, theirs = learner.policy(0).weights, other.policy(0).weights
    for name, array in theirs.items():
        if name.startswith("actor."):
            assert np.array_equal(array, ours[name]), name
    drawn = [n for n in theirs if n.startswith("critic") and n.endswith("0.weight")]
    assert len(drawn) == 4  # twins, and their targets
    assert all(np.array_equal(theirs[name], ours[name]) is same for name in drawn)


def test_a_phase_that_bounds_its_replay_keeps_the_latest():
    schedule = dataclasses.replace(METHODS["revolver"].schedule, latest=4)
    method = dataclasses.replace(METHODS["revolver"], schedule=schedule)
    settings = dataclasses.replace(TINY, learning_starts=99)
    learner = StackedLearner(settings, O, A, [Member(method=method, seed=0)], capacity=100)
    learner.enter(0, 0.0)
    for k in range(3):
        step(learner, k)
    before = learner.replay.dump(0)[0].clone()
    assert learner.enter(0, 0.04) == 4
    assert torch.equal(learner.replay.dump(0)[0], before[-4:])


def test_cleaning_takes_a_single_transition_too():
    replay = StackedReplay(1, 10, 1, 1)
    for k in range(5):
        value = np.array([[float(k)]])
        replay.extend(np.array([0]), value, value, value[0], value, np.array([False]),
                      np.array([k / 10]))  # fmt: skip
    assert replay.clean(0, 0.1, 1.0) == 4
    assert replay.dump(0)[0][:, 0].tolist() == [1, 2, 3, 4]
    assert replay.clean(0, 0.1, 0.4) == 4  # both ends belong to it
