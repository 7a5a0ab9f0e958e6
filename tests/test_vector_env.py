"""The vector door: n robots are n single environments, whatever happens to some of them."""

import platform
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from mujoco.batch import SimulationError

from revolver_lab.envs import snapshot
from revolver_lab.envs.memory import return_large_blocks
from revolver_lab.envs.registration import register_environments
from revolver_lab.envs.single import RobotEnv
from revolver_lab.envs.vector import make_vec_env
from revolver_lab.errors import AlphaError, SettingsError, UnknownNameError
from revolver_lab.evolution.evolution import Evolution
from revolver_lab.robots import registry
from revolver_lab.tasks.running import SpeedTrap

NAMES = registry.names()


def brief(name, steps=9):
    """The robot's task with few steps an episode."""
    task = registry.get(name).make_task()
    task.episode_steps = steps
    return task


def random_actions(env, steps, seed=0):
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (steps, *env.action_space.shape))


def assert_same(ours, theirs):
    for mine, other in zip(ours, theirs, strict=True):
        assert data_equivalence(mine, other, exact=True), f"{mine}\n{other}"


@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
@pytest.mark.parametrize("name", NAMES)
def test_it_equals_gymnasiums_sync_vector_env_of_single_envs(name, mode):
    """Bit for bit: observations, rewards, ends and every info, final ones included."""
    alphas = [0.0, 0.35, 1.0]
    env = make_vec_env(name, 3, alphas=alphas, task=brief(name), autoreset_mode=mode)

    def single(i):
        return lambda: RobotEnv(name, alpha=alphas[i], task=brief(name), simulation=i)

    with np.errstate(all="ignore"):
        singles = SyncVectorEnv([single(i) for i in range(3)], autoreset_mode=AutoresetMode(mode))
    assert_same(env.reset(seed=8), singles.reset(seed=[8] * 3))
    for k, actions in enumerate(random_actions(env, 32)):
        if k == 15:
            actions[1] = np.nan
        assert_same(env.step(actions), singles.step(actions))


def test_it_equals_single_envs_when_every_episode_draws_another_robot():
    name, n = "cheetah-long-legs", 3
    env = make_vec_env(name, n, task=brief(name), seed=2, draw_alpha=lambda i, rng: rng.uniform())
    singles = [RobotEnv(name, task=brief(name), simulation=i) for i in range(n)]

    def restart(i, seed=None):
        return singles[i].reset(seed=seed, options={"alpha": env.alphas[i]})[0]

    observations, infos = env.reset()
    np.testing.assert_array_equal(observations, [restart(i, 2) for i in range(n)])
    seen = [infos["alpha"]]
    for actions in random_actions(env, 30):
        observations, _, terminated, truncated, infos = env.step(actions)
        for i in range(n):
            last = singles[i].step(actions[i])[0]
            if terminated[i] or truncated[i]:
                np.testing.assert_array_equal(infos["final_obs"][i], last)
                assert infos["final_info"]["alpha"][i] == singles[i].alpha
                last = restart(i)
            np.testing.assert_array_equal(observations[i], last)
        seen.append(infos["alpha"])
    assert len(np.unique(seen)) == 4 * n


@pytest.mark.parametrize("name", ["cheetah-front-leg", "ant-leg-emerge", "humanoid-length-mass"])
def test_a_simulation_does_not_depend_on_how_many_there_are_or_on_threads(name):
    runs = []
    for n, threads in ((1, 1), (8, 1), (8, 4)):
        env = make_vec_env(
            name,
            n,
            task=brief(name),
            seed=4,
            nthread=threads,
            draw_alpha=lambda i, rng: rng.random(),
        )
        run = [env.reset()[0][0]]
        run += [env.step(actions[:n])[0][0] for actions in random_actions_of(env, 25)]
        runs.append(np.array(run))
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[2])


def random_actions_of(env, steps):
    """Actions of eight simulations, whatever the number there is."""
    shape = (steps, 8, *env.single_action_space.shape)
    return np.random.default_rng(0).uniform(-1, 1, shape)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e12])
@pytest.mark.parametrize("name", ["cheetah-front-leg", "humanoid-length-mass"])
def test_a_diverging_neighbour_is_flagged_and_changes_nothing_for_the_others(name, bad):
    calm, hit = (make_vec_env(name, 4, seed=1, alphas=0.5) for _ in range(2))
    last = calm.reset()[0]
    hit.reset()
    others = [0, 1, 3]
    for k, actions in enumerate(random_actions(calm, 12)):
        if k == 5:
            hit.batch.bind("qvel")[2, 0] = bad
        expected = calm.step(actions)
        observations, rewards, terminated, truncated, infos = hit.step(actions)
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        np.testing.assert_array_equal(observations[others], expected[0][others])
        np.testing.assert_array_equal(rewards[others], expected[1][others])
        assert not infos["diverged"].any(), "the new episode has not diverged"
        if k == 5:
            assert terminated.tolist() == [False, False, True, False]
            assert not truncated.any()
            assert rewards[2] == 0
            np.testing.assert_array_equal(infos["final_obs"][2], last[2])
            assert infos["final_info"]["diverged"].tolist() == [False, False, True, False]
        last = observations


def test_next_step_mode_flags_divergence_where_it_happens():
    env = make_vec_env("ant-length-mass", 2, seed=1, autoreset_mode="NextStep")
    env.reset()
    env.batch.bind("qvel")[0] = np.nan
    _, _, terminated, _, infos = env.step(np.zeros((2, 8)))
    assert terminated.tolist() == infos["diverged"].tolist() == [True, False]
    _, rewards, terminated, _, infos = env.step(np.zeros((2, 8)))
    assert not terminated.any()
    assert not infos["diverged"].any()
    assert rewards[0] == 0


def test_a_simulation_on_which_mujoco_gives_up_has_diverged(monkeypatch):
    env = make_vec_env("ant-length-mass", 3, seed=1)
    last = env.reset()[0]

    def give_up(*_):
        raise SimulationError(np.array([1]), "out of memory")

    monkeypatch.setattr(env.batch, "step", give_up)
    _, rewards, terminated, _, infos = env.step(np.zeros((3, 8)))
    assert terminated.tolist() == [False, True, False]
    assert rewards[1] == 0
    assert infos["final_info"]["diverged"].tolist() == [False, True, False]
    np.testing.assert_array_equal(infos["final_obs"][1], last[1])


def test_set_alphas_waits_for_the_next_episode():
    env = make_vec_env("cheetah-front-leg", 2, alphas=0.1, task=brief("cheetah-front-leg"), seed=0)
    env.reset()
    env.set_alphas([0.4, 0.8])
    for k in range(9):
        *_, infos = env.step(np.zeros((2, 6)))
        assert infos["alpha"].tolist() == ([0.1, 0.1] if k < 8 else [0.4, 0.8])
    assert infos["final_info"]["alpha"].tolist() == [0.1, 0.1]
    for alpha, model in zip((0.4, 0.8), env.models):
        expected = registry.load("cheetah-front-leg").model(alpha)
        np.testing.assert_array_equal(model.geom_size, expected.geom_size)
        np.testing.assert_array_equal(model.body_inertia, expected.body_inertia)


def test_alphas_are_drawn_from_streams_of_their_own():
    draws = {}
    for n in (2, 5):
        env = make_vec_env("cheetah-front-leg", n, seed=9, draw_alpha=lambda i, rng: rng.random())
        draws[n] = env.reset()[1]["alpha"][:2].tolist()
    assert draws[2] == draws[5]
    assert draws[2][0] != draws[2][1]


def test_resetting_with_the_seed_starts_the_same_story_again():
    env = make_vec_env("ant-length-mass", 2, seed=3, draw_alpha=lambda i, rng: rng.random())
    first, again, other = env.reset()[0], env.reset(seed=3)[0], env.reset()[0]
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_gymnasium_makes_it_by_id():
    register_environments()
    env = gymnasium.make_vec("revolver_lab/CheetahShortLegs-v0", num_envs=3, alpha=0.5)
    assert env.reset(seed=0)[1]["alpha"].tolist() == [0.5] * 3
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


@pytest.mark.parametrize(
    ("settings", "error", "text"),
    [
        ({"n": 0}, SettingsError, "1 or more"),
        ({"n": 2.0}, SettingsError, "whole number"),
        ({"n": 2, "alphas": [0.1, 0.2, 0.3]}, SettingsError, r"\(2,\)"),
        ({"n": 2, "alphas": [0.1, np.nan]}, AlphaError, "nan"),
        ({"n": 2, "autoreset_mode": "Disabled"}, SettingsError, "'NextStep'"),
        ({"n": 2, "task": "dens"}, UnknownNameError, "dense"),
    ],
)
def test_settings_that_cannot_work_are_refused(settings, error, text):
    with pytest.raises(error, match=text):
        make_vec_env("cheetah-front-leg", **settings)


def test_an_evolution_of_ones_own_needs_a_task_and_works_with_one():
    robot = registry.get("cheetah-front-leg")
    evolve = Evolution(robot.source(), robot.target(), name="mine")
    with pytest.raises(SettingsError, match="'mine', which is not registered"):
        make_vec_env(evolve, 2)
    ours = make_vec_env(evolve, 2, task=SpeedTrap(), alphas=0.5, seed=0)
    theirs = make_vec_env("cheetah-front-leg", 2, alphas=0.5, seed=0)
    np.testing.assert_array_equal(ours.reset()[0], theirs.reset()[0])


def test_actions_of_another_shape_are_refused():
    env = make_vec_env("cheetah-front-leg", 2)
    env.reset()
    with pytest.raises(SettingsError, match=r"\(2, 6\)"):
        env.step(np.zeros(6))


def test_an_alpha_drawn_outside_is_refused():
    env = make_vec_env("cheetah-front-leg", 2, draw_alpha=lambda i, rng: 1.01)
    with pytest.raises(AlphaError, match=r"1\.01"):
        env.reset()


def test_stable_baselines_gets_what_it_stores():
    adapter = pytest.importorskip("revolver_lab.learners.sb3_env")
    plain, inner = (
        make_vec_env(
            "cheetah-front-leg",
            3,
            task=brief("cheetah-front-leg", 4),
            seed=0,
            draw_alpha=lambda i, rng: rng.random(),
        )
        for _ in range(2)
    )
    env = adapter.Sb3VecEnv(inner)
    np.testing.assert_array_equal(env.reset(), plain.reset()[0])
    for k, actions in enumerate(random_actions(plain, 10)):
        if k == 6:
            actions[1] = np.nan
        alphas = plain.alphas.copy()
        expected = plain.step(actions)
        observations, rewards, dones, infos = env.step(actions)
        np.testing.assert_array_equal(observations, expected[0])
        np.testing.assert_array_equal(rewards, expected[1].astype(np.float32))
        np.testing.assert_array_equal(dones, expected[2] | expected[3])
        for i, info in enumerate(infos):
            assert info["alpha"] == alphas[i]
            assert info["diverged"] is (k == 6 and i == 1)
            assert info["TimeLimit.truncated"] is bool(expected[3][i])
            assert ("terminal_observation" in info) is ("episode" in info) is bool(dones[i])
            if dones[i]:
                np.testing.assert_array_equal(
                    info["terminal_observation"], expected[4]["final_obs"][i]
                )


BLOCKS = """
import ctypes
from revolver_lab.envs.memory import return_large_blocks
names = "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost".split()
class Blocks(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in names]
libc = ctypes.CDLL("libc.so.6")
libc.mallinfo2.restype, libc.malloc.restype = Blocks, ctypes.c_void_p
libc.free.argtypes = [ctypes.c_void_p]
if {returned}:
    return_large_blocks()
libc.free(libc.malloc(16 << 20))  # by itself glibc would keep blocks of such a size from here on
before = libc.mallinfo2().hblkhd  # bytes outside the heap
libc.malloc(8 << 20)
print(libc.mallinfo2().hblkhd - before >> 20)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="no glibc")
def test_large_blocks_go_back_to_the_system_when_they_are_freed():
    for returned, outside in ((False, "0\n"), (True, "8\n")):
        code = BLOCKS.format(returned=returned)
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.stdout == outside, done.stderr
    make_vec_env("ball-in-cup-weak-motors", 1)
    assert return_large_blocks.cache_info().currsize == 1


@pytest.mark.parametrize("name", ["humanoid-length-mass", "ant-length-mass"])
def test_from_a_snapshot_on_nothing_is_different_where_forces_and_masses_are_seen(name):
    whole, rest = (make_vec_env(name, 2, alphas=[0.2, 0.9], seed=s, nthread=1) for s in (4, 9))
    whole.reset()
    rest.reset()
    actions = np.random.default_rng(0).uniform(-1, 1, (60, *whole.action_space.shape))
    for action in actions[:35]:
        whole.step(action)
    held = snapshot.take(whole)
    expected = [whole.step(action)[:4] for action in actions[35:]]
    for action in actions[:3]:
        rest.step(action)
    snapshot.put_back(rest, *held)
    found = [rest.step(action)[:4] for action in actions[35:]]
    for ours, theirs in zip(found, expected, strict=True):
        for mine, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(mine, other)
    assert np.abs(np.array([step[1] for step in expected])).min() > 0
