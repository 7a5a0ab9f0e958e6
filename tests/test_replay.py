"""The tagged replay: shaping in closed form, cleaning as a plain filter, nothing lost."""

import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from revolver_lab.learners.replay import TaggedReplay

BOX, ACT = spaces.Box(-9, 9, (2,), np.float32), spaces.Box(-1, 1, (1,), np.float32)


def filled(betas, size=1000, n=1, shaping=0.0):
    """A replay of transitions that all can be told apart by their reward."""
    replay = TaggedReplay(size, BOX, ACT, "cpu", n_envs=n, shaping=shaping, seed=0)
    for start in range(0, len(betas), n):
        chunk = np.array(betas[start : start + n])
        k = start + np.arange(len(chunk), dtype=np.float32)
        observation = np.stack([k, k], axis=1)
        replay.extend(observation, observation + 0.5, k[:, None] / 1e6, k, k % 2 == 1, chunk)
    return replay


def contents(replay):
    """(reward, beta) in the order they came."""
    rows = np.arange(replay.pos)
    if replay.full:
        rows = np.concatenate([np.arange(replay.pos, replay.buffer_size), rows])
    return [(float(replay.rewards[i, 0]), float(replay.betas[i])) for i in rows]


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.sampled_from([0.0, 0.1, 0.2, 0.3, 0.4, 1.0]), min_size=1, max_size=40),
    st.integers(1, 4),
    st.integers(4, 30),
    st.sampled_from([(0.1, 0.3), (0.2, 0.2), (0.35, 0.39), (-1.0, 2.0)]),
)
def test_cleaning_equals_a_plain_filter_of_the_latest_transitions(betas, n, size, interval):
    betas = betas[: len(betas) // n * n]
    replay = filled(betas, size=size, n=n)
    low, high = interval
    stored = [(float(k), beta) for k, beta in enumerate(betas)][-size:]
    expected = [(k, beta) for k, beta in stored if low <= beta <= high]
    assert replay.clean(low, high) == len(expected)
    assert contents(replay) == expected


def test_cleaned_rows_stay_whole():
    replay = filled([0.0, 0.2] * 10)
    replay.clean(0.1, 0.3)
    rows = np.arange(replay.pos)
    k = replay.rewards[rows, 0]
    assert np.array_equal(k, np.arange(1, 20, 2))
    assert np.array_equal(replay.observations[rows, 0, 0], k)
    assert np.array_equal(replay.next_observations[rows, 0, 1], k + 0.5)
    assert np.array_equal(replay.dones[rows, 0], k % 2)


def test_rewards_are_weighted_by_exp_h_beta_only_when_sampled():
    betas = np.linspace(0, 1, 11)
    replay = filled(betas, shaping=1.7)
    batch = replay.sample(500)
    k = batch.observations[:, 0].numpy()
    assert np.allclose(batch.rewards[:, 0], k * np.exp(1.7 * betas[k.astype(int)]), rtol=1e-6)
    assert np.array_equal(replay.rewards[:11, 0], np.arange(11))  # stored as earned


def test_no_shaping_leaves_rewards_alone():
    batch = filled(np.linspace(0, 1, 11)).sample(50)
    assert np.array_equal(batch.rewards[:, 0], batch.observations[:, 0])


def test_one_transition_is_enough_to_sample_a_batch():
    replay = filled([0.0, 0.5])
    replay.clean(0.4, 0.6)
    batch = replay.sample(64)
    assert batch.rewards.shape == (64, 1)
    assert (batch.rewards == 1).all()


def test_samples_are_uniform_over_what_is_kept():
    replay = filled([0.0] * 5 + [0.5] * 5)
    replay.clean(0.5, 0.5)
    found, counts = np.unique(replay.sample(5000).rewards.numpy(), return_counts=True)
    assert found.tolist() == [5, 6, 7, 8, 9]
    assert (abs(counts - 1000) < 5 * np.sqrt(1000)).all()


def test_the_same_seed_samples_the_same():
    first, second = filled([0.1] * 50).sample(20), filled([0.1] * 50).sample(20)
    assert np.array_equal(first.rewards, second.rewards)


@pytest.mark.parametrize("timed_out", [True, False])
def test_running_out_of_time_is_not_an_end(timed_out):
    replay = TaggedReplay(10, BOX, ACT, "cpu", n_envs=2)
    info = {"alpha": 0.25, "TimeLimit.truncated": timed_out}
    z = np.zeros((2, 2))
    replay.add(z, z, np.zeros((2, 1)), np.ones(2), np.array([True, False]), [info, {"alpha": 0.5}])
    assert replay.dones[:2, 0].tolist() == [float(not timed_out), 0.0]
    assert replay.betas[:2].tolist() == [0.25, 0.5]


@pytest.mark.parametrize("size", [1000, 8])  # with room, and after going round
def test_of_what_is_kept_only_so_many_of_the_latest_stay(size):
    replay = filled([0.1, 0.5] * 6, size=size)
    assert replay.clean(0.4, 0.6, latest=3) == 3
    assert [k for k, _ in contents(replay)] == [7, 9, 11]
    assert replay.clean(0.4, 0.6, latest=10) == 3


@pytest.mark.parametrize("form", ["relative", "normalised"])
def test_the_other_forms_of_shaping_know_the_phase(form):
    betas = np.linspace(0.5, 0.7, 11)
    replay = filled(betas, shaping=3.0)
    replay.alpha, replay.xi, replay.shaping_form = 0.5, 0.2, form
    batch = replay.sample(300)
    k = batch.observations[:, 0].numpy()
    # exp(h (beta - alpha)), over its mean on [alpha, alpha + xi] where it is normalised
    fine = 0.2 * (np.arange(10_000) + 0.5) / 10_000
    mean = np.exp(3.0 * fine).mean() if form == "normalised" else 1.0
    expected = k * np.exp(3.0 * (betas[k.astype(int)] - 0.5)) / mean
    np.testing.assert_allclose(batch.rewards[:, 0].numpy(), expected, rtol=1e-5)


def test_running_out_of_time_may_be_told_to_be_an_end():
    replay = TaggedReplay(10, BOX, ACT, "cpu", handle_timeout_termination=False)
    z = np.zeros((1, 2))
    info = {"alpha": 0.0, "TimeLimit.truncated": True}
    replay.add(z, z, np.zeros((1, 1)), np.ones(1), np.array([True]), [info])
    assert replay.dones[0, 0] == 1.0
