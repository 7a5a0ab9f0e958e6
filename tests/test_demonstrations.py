"""Demonstrations: one record, from a policy, a plain file or Minari, and what is refused."""

import sys

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from natural_puck import EXPERT, LENGTH, Failing, Reach, feedback, puck

from revolver_lab.demonstration_sources import from_minari, record
from revolver_lab.demonstrations import Demonstrations
from revolver_lab.envs.single import RobotEnv
from revolver_lab.errors import DemonstrationsError, MissingExtraError, SettingsError
from revolver_lab.trajectories import Success


@pytest.fixture(scope="module")
def evolve():
    return puck()


def some(**changes):
    rng = np.random.default_rng(0)
    arrays = {
        "lengths": np.array([2, 3]), "observations": rng.standard_normal((5, 4)),
        "actions": rng.standard_normal((5, 2)), "next_observations": rng.standard_normal((5, 4)),
        "rewards": np.arange(5.0),
    }  # fmt: skip
    return Demonstrations(**arrays | changes)


def equal(one, other):
    names = ("lengths", "observations", "actions", "next_observations", "rewards")
    return all(np.array_equal(getattr(one, n), getattr(other, n)) for n in names)


def test_a_recording_is_what_the_single_environment_shows(evolve):
    recorded = record(EXPERT, evolve, 3, alpha=0.2, seed=7, task=Reach())
    assert len(recorded) == 3
    assert recorded.lengths.tolist() == [LENGTH] * 3
    for i in range(3):
        env = RobotEnv(evolve, alpha=0.2, task=Reach(), simulation=i)
        seen, _ = env.reset(seed=7)
        for t in range(i * LENGTH, (i + 1) * LENGTH):
            assert np.allclose(recorded.observations[t], seen, atol=1e-5)
            assert np.allclose(recorded.actions[t], EXPERT(seen), atol=1e-6)
            seen, reward, *_ = env.step(EXPERT(seen))
            assert np.allclose(recorded.next_observations[t], seen, atol=1e-5)
            assert recorded.rewards[t] == reward
    assert "alpha = 0.2" in recorded.origin


def test_more_episodes_than_play_side_by_side_are_all_different(evolve):
    recorded = record(EXPERT, evolve, 23, task=Reach())
    starts = recorded.observations[np.cumsum(recorded.lengths) - recorded.lengths]
    assert len(recorded) == len(np.unique(starts[:, 0])) == 23


def test_episodes_that_failed_can_be_left_out(evolve):
    clumsy = feedback([-0.25, -0.1])
    every = record(clumsy, evolve, 20, task=Reach())
    good = record(clumsy, evolve, 20, task=Reach(), success=Success())
    assert 0 < len(good) < 20
    assert np.array_equal(good.returns, every.returns[every.returns > 5])
    with pytest.raises(DemonstrationsError, match="none succeeded"):
        record(feedback([3.0, 3.0]), evolve, 4, task=Reach(), success=Success())
    with pytest.raises(SettingsError, match="episodes = 0"):
        record(EXPERT, evolve, 0)


def test_recordings_end_where_the_episode_did(evolve):
    recorded = record(feedback([3.0, 3.0]), evolve, 5, task=Failing())
    assert (recorded.lengths < LENGTH).all()
    ends = recorded.next_observations[np.cumsum(recorded.lengths) - 1, 0]
    assert (np.abs(ends) > 2.5).all()


def test_a_file_gives_back_what_was_saved(tmp_path):
    path = some(origin="somewhere").save(tmp_path / "demos")
    assert path.name == "demos.npz"
    again = Demonstrations.load(path)
    assert equal(again, some())
    assert again.origin == "somewhere"
    assert [p.name for p in tmp_path.iterdir()] == ["demos.npz"]


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(2, 6), min_size=1, max_size=5))
def test_plain_arrays_lead_from_each_row_to_the_next_within_an_episode(lengths):
    import tempfile
    from pathlib import Path

    total = sum(lengths)
    seen = np.arange(total, dtype=float)[:, None]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plain.npz"
        np.savez(path, lengths=np.array(lengths), observations=seen, actions=-seen,
                 init_qpos=np.zeros((len(lengths), 30)))  # fmt: skip
        found = Demonstrations.load(path)
    assert found.lengths.tolist() == [length - 1 for length in lengths]
    assert np.array_equal(found.next_observations, found.observations + 1)
    assert np.array_equal(found.actions, -found.observations)
    starts = np.cumsum([0, *lengths[:-1]])
    assert np.array_equal(found.observations[np.cumsum([0, *found.lengths[:-1]]), 0], starts)
    assert not found.rewards.any()


def test_returns_are_sums_of_each_episodes_rewards():
    assert some().returns.tolist() == [0 + 1, 2 + 3 + 4]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"lengths": np.array([2, 2])}, "4 transitions"),
        ({"lengths": np.array([5, 0])}, "episodes of"),
        ({"lengths": np.array([2.0, 3.0])}, "lengths"),
        ({"lengths": np.array([], int)}, "episodes of"),
        ({"observations": np.zeros(5)}, "observations of shape"),
        ({"observations": np.full((5, 4), np.nan)}, "not finite"),
        ({"next_observations": np.zeros((5, 3))}, "that lead to"),
        ({"rewards": np.zeros(4)}, "5 transitions"),
        ({"actions": np.array([["a", "b"]] * 5)}, "actions"),
    ],
)
def test_arrays_that_do_not_belong_together_are_refused(changes, text):
    with pytest.raises(DemonstrationsError) as caught:
        some(**changes)
    assert text in str(caught.value)


def test_files_that_are_torn_foreign_or_hostile_are_refused(tmp_path):
    whole = some().save(tmp_path / "whole.npz").read_bytes()
    (tmp_path / "torn.npz").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "flipped.npz").write_bytes(whole[:200] + bytes(50) + whole[250:])
    (tmp_path / "text.npz").write_text("lengths")
    np.savez(tmp_path / "lacking.npz", lengths=np.array([2]))
    np.savez(tmp_path / "pickled.npz", lengths=np.array([{}], dtype=object),
             observations=np.zeros((1, 1)), actions=np.zeros((1, 1)))  # fmt: skip
    np.savez(tmp_path / "short.npz", lengths=np.array([3]), observations=np.zeros((2, 1)),
             actions=np.zeros((2, 1)))  # fmt: skip
    for name in ("torn", "flipped", "text", "lacking", "pickled", "short", "missing"):
        with pytest.raises(DemonstrationsError):
            Demonstrations.load(tmp_path / f"{name}.npz")


def test_demonstrations_of_another_robot_are_refused():
    assert some().fits(4, 2)
    with pytest.raises(DemonstrationsError, match="4 observations and 2 actions"):
        some().fits(5, 2)


@pytest.mark.filterwarnings("ignore::UserWarning:minari")
def test_a_minari_dataset_reads_as_it_was_written(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    buffers = pytest.importorskip("minari.data_collector.episode_buffer")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    rng, episodes = np.random.default_rng(0), []
    for i, steps in enumerate((4, 2, 3)):
        episodes.append(buffers.EpisodeBuffer(
            id=i, observations=rng.standard_normal((steps + 1, 3)),
            actions=rng.uniform(-1, 1, (steps, 2)), rewards=[1.0 * i] * steps,
            terminations=[False] * steps, truncations=[False] * (steps - 1) + [True], infos={},
        ))  # fmt: skip
    box = gymnasium.spaces.Box
    minari.create_dataset_from_buffers(
        "puck/test-v0", buffer=episodes, action_space=box(-1, 1, (2,), np.float64),
        observation_space=box(-np.inf, np.inf, (3,), np.float64), data_format="hdf5",
    )  # fmt: skip
    found = from_minari("puck/test-v0")
    assert found.lengths.tolist() == [4, 2, 3]
    seen = [e.observations.astype(np.float32) for e in episodes]
    assert np.array_equal(found.observations, np.concatenate([s[:-1] for s in seen]))
    assert np.array_equal(found.next_observations, np.concatenate([s[1:] for s in seen]))
    assert found.returns.tolist() == [0, 2, 6]
    assert found.origin == "Minari's puck/test-v0"
    assert len(from_minari(minari.load_dataset("puck/test-v0"), episodes=[2])) == 1


def test_a_minari_dataset_that_is_not_there_is_refused(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))

    def offline(*_, **__):
        raise ConnectionError("no network")

    monkeypatch.setattr(minari.storage.hosting, "download_dataset", offline)
    with pytest.raises(DemonstrationsError, match="D4RL/door/none-v9"):
        from_minari("D4RL/door/none-v9")
    monkeypatch.setitem(sys.modules, "minari", None)
    with pytest.raises(MissingExtraError, match="demos"):
        from_minari("D4RL/door/human-v2")
