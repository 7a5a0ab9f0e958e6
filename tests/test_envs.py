"""The gymnasium and the dm_env door: the contracts of both, and that they are one door."""

import subprocess
import sys
import warnings

import gymnasium
import mujoco
import numpy as np
import pytest
from absl.testing import absltest
from dm_env import StepType, test_utils
from gymnasium.utils.env_checker import check_env
from natural_puck import Reach, puck

import revolver_lab as rvl
from revolver_lab import _gl
from revolver_lab.envs import suite
from revolver_lab.envs.core import HUGE, Controls, Purpose, judge, stream
from revolver_lab.envs.registration import environment_id, register_environments
from revolver_lab.envs.single import RobotEnv
from revolver_lab.errors import AlphaError, SettingsError, UnknownNameError
from revolver_lab.robots import registry
from revolver_lab.tasks.base import State, Task
from revolver_lab.tasks.running import SpeedTrap

NAMES = registry.names()
register_environments()


class Brief(SpeedTrap):
    """The speed trap in 12 steps."""

    episode_steps = 12


def actions(env, n, seed=0):
    shape = env.action_space.shape
    return np.random.default_rng(seed).uniform(-1, 1, (n, *shape)).astype(np.float32)


@pytest.mark.parametrize("name", NAMES)
def test_gymnasiums_checker_has_nothing_to_say(name):
    env = gymnasium.make(environment_id(name), alpha=0.3).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*Box observation space m.*infinity")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("name", NAMES)
def test_stable_baselines_checker_has_nothing_to_say(name):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(RobotEnv(name, alpha=1.0))


@pytest.mark.parametrize("name", NAMES)
def test_the_dm_env_contract_holds(name):
    robot = registry.get(name)

    class Contract(test_utils.EnvironmentTestMixin, absltest.TestCase):
        def make_object_under_test(self):
            return suite.load(robot.domain, robot.task, alpha=0.3, seed=0)

    outcome = absltest.unittest.TestResult()
    absltest.unittest.defaultTestLoader.loadTestsFromTestCase(Contract).run(outcome)
    assert outcome.testsRun >= 4
    assert outcome.wasSuccessful(), outcome.errors + outcome.failures


def test_the_dm_env_contract_holds_across_ends_of_episodes():
    class Contract(test_utils.EnvironmentTestMixin, absltest.TestCase):
        def make_object_under_test(self):
            return suite.SuiteEnv("cheetah-front-leg", task=Brief())

    outcome = absltest.unittest.TestResult()
    absltest.unittest.defaultTestLoader.loadTestsFromTestCase(Contract).run(outcome)
    assert outcome.wasSuccessful(), outcome.errors + outcome.failures


@pytest.mark.parametrize("name", NAMES)
def test_both_doors_give_the_same_trajectory(name):
    robot = registry.get(name)
    env = gymnasium.make(environment_id(name), alpha=0.6)
    twin = suite.load(robot.domain, robot.task, alpha=0.6, seed=11)
    observation, _ = env.reset(seed=11)
    np.testing.assert_array_equal(observation, twin.reset().observation)
    for action in actions(env, 60):
        observation, reward, terminated, truncated, _ = env.step(action)
        step = twin.step(action)
        np.testing.assert_array_equal(observation, step.observation)
        assert reward == step.reward
        assert step.last() is (terminated or truncated)
        if step.last():
            assert step.discount == 0
            np.testing.assert_array_equal(env.reset()[0], twin.reset().observation)


def test_a_new_alpha_at_reset_is_a_new_environment_of_that_alpha():
    moved, fresh = RobotEnv("ant-length-mass", alpha=0.1), RobotEnv("ant-length-mass", alpha=0.9)
    moved.reset(seed=0)
    for action in actions(moved, 5):
        moved.step(action)
    first, info = moved.reset(seed=4, options={"alpha": 0.9})
    assert info["alpha"] == moved.alpha == 0.9
    np.testing.assert_array_equal(first, fresh.reset(seed=4)[0])
    for action in actions(moved, 20):
        np.testing.assert_array_equal(moved.step(action)[0], fresh.step(action)[0])


def test_a_twin_moved_to_alpha_is_one_loaded_at_alpha():
    moved = suite.load("cheetah", "front_leg", alpha=0.0, seed=3)
    fresh = suite.load("cheetah", "front_leg", alpha=1.0, seed=3)
    moved.set_alpha(1.0)
    for action in np.random.default_rng(0).uniform(-1, 1, (20, 6)):
        np.testing.assert_array_equal(
            moved.step(action).observation, fresh.step(action).observation
        )


def test_an_episode_ends_with_its_unshaped_return():
    env = RobotEnv("cheetah-front-leg", task=Brief())
    env.reset(seed=0)
    env.simulation.data.qpos[0], env.simulation.data.qvel[0] = 6.0, 10.0
    steps = [env.step(np.zeros(6)) for _ in range(12)]
    assert [step[3] for step in steps] == [False] * 11 + [True]
    assert steps[-1][4]["episode"] == {"r": sum(step[1] for step in steps), "l": 12}
    assert steps[-1][4]["episode"]["r"] > 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_a_diverged_robot_ends_its_episode_finitely(bad):
    env = RobotEnv("ant-length-mass")
    env.reset(seed=0)
    last = env.step(np.zeros(8))[0]
    env.simulation.data.qvel[3] = bad
    observation, reward, terminated, truncated, info = env.step(np.zeros(8))
    np.testing.assert_array_equal(observation, last)
    assert (reward, terminated, truncated, info["diverged"]) == (0.0, True, False, True)
    env.reset()
    assert not env.step(np.zeros(8))[4]["diverged"]


def test_a_robot_on_which_mujoco_gives_up_has_diverged(monkeypatch):
    env = RobotEnv("ant-length-mass")
    last = env.reset(seed=0)[0]

    def give_up(*_):
        raise mujoco.FatalError("out of memory")

    monkeypatch.setattr(mujoco, "mj_step", give_up)
    observation, reward, terminated, _, info = env.step(np.zeros(8))
    np.testing.assert_array_equal(observation, last)
    assert (reward, terminated, info["diverged"]) == (0.0, True, True)


def test_a_frame_shows_the_robot_of_this_alpha():
    if not _gl.choose().works:
        pytest.skip("no OpenGL on this machine")
    env = RobotEnv("cheetah-long-legs", render_mode="rgb_array", width=64, height=48)
    env.reset(seed=0)
    short = env.render()
    env.reset(seed=0, options={"alpha": 1.0})
    long = env.render()
    env.close()
    assert short.shape == long.shape == (48, 64, 3)
    assert np.abs(short.astype(int) - long).mean() > 1
    assert RobotEnv("cheetah-long-legs").render() is None


def test_an_action_that_is_no_number_diverges_instead_of_passing_through():
    env = suite.load("cheetah", "front_leg", seed=0)
    env.reset()
    step = env.step(np.full(6, np.nan))
    assert (step.step_type, step.reward, step.discount) == (StepType.LAST, 0.0, 0.0)
    assert np.isfinite(step.observation).all()
    assert env.diverged


class Shown(Task):
    """Shows positions and pays for speeds, whatever they are."""

    def observe(self, robot):
        return robot.qpos

    def reward(self, robot, before):
        return robot.qvel[:, 0]

    def initial_state(self, model, rng):
        return model.qpos0, np.zeros(model.nv)


@pytest.mark.parametrize("number", [0.0, 1e4, -9e4, 0.99 * HUGE, HUGE, -2 * HUGE, np.inf, np.nan])
@pytest.mark.parametrize("where", ["qpos", "qvel"])
@pytest.mark.parametrize("robots", [3, 6000])  # where a glance says enough, and where it is spared
def test_what_is_large_but_legal_has_not_diverged(number, where, robots):
    fields = {"qpos": np.ones((robots, 2)), "qvel": np.ones((robots, 1))}
    fields[where][1, -1] = number
    last = np.full((robots, 2), 7, np.float32)
    seen = judge(Shown(), State(fields), None, np.zeros(robots, dtype=bool), last)
    fallen = not abs(number) < HUGE
    assert seen.diverged.sum() == seen.terminated.sum() == seen.diverged[1] == fallen
    assert seen.reward[1] == (0.0 if fallen else fields["qvel"][1, 0])
    assert (seen.observation[1] == (7.0 if fallen else fields["qpos"][1].astype(np.float32))).all()


def test_actions_are_scaled_to_the_control_ranges_and_clipped():
    model = registry.load("humanoid-length-mass").model(0)
    to_ctrl = Controls.of(model)
    np.testing.assert_allclose(to_ctrl(np.full(17, 0.5), (17,)), 0.5 * 0.4)
    np.testing.assert_allclose(to_ctrl(np.full(17, -7.0), (17,)), -0.4)


def test_streams_are_told_apart_by_seed_simulation_and_purpose():
    keys = [(s, i, p) for s in range(3) for i in range(3) for p in Purpose]
    assert len({stream(*key).random() for key in keys}) == len(keys)


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: RobotEnv("cheeta-front-leg"), UnknownNameError, "cheetah-front-leg"),
        (lambda: RobotEnv("cheetah-front-leg", task="spars"), UnknownNameError, "sparse"),
        (lambda: RobotEnv("cheetah-front-leg", alpha=1.5), AlphaError, "1.5"),
        (lambda: suite.load("cheetah", "front"), UnknownNameError, "front_leg"),
        (lambda: RobotEnv("cheetah-front-leg").step(np.zeros(5)), SettingsError, r"\(6,\)"),
        (lambda: RobotEnv("cheetah-front-leg").reset(options={"alpha": -1}), AlphaError, "-1"),
    ],
)
def test_what_cannot_work_is_refused_with_what_can(make, error, text):
    with pytest.raises(error, match=text):
        make()


def test_registering_imports_neither_mujoco_nor_an_environment():
    code = (
        "import sys; from revolver_lab.envs.registration import register_environments;"
        "register_environments(); register_environments();"
        "bad = {'mujoco', 'dm_control', 'torch', 'revolver_lab.envs.single'} & set(sys.modules);"
        "assert not bad, bad"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


ARM = """<robot name='arm'><link name='base'/><link name='tip'><inertial><mass value='1'/>
<inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link>
<joint name='turn' type='revolute'><parent link='base'/><child link='tip'/><axis xyz='0 1 0'/>
<limit lower='-1' upper='1' effort='{}' velocity='2'/></joint></robot>"""


def arm(effort, *motors):
    """A URDF as an MjSpec, with motors that a URDF cannot have."""
    spec = mujoco.MjSpec.from_string(ARM.format(effort))
    for name in motors:
        spec.add_actuator(name=name, target="turn", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    return spec


def test_a_urdf_has_no_actuators_until_they_are_added_to_its_specification():
    with pytest.raises(SettingsError, match=r"without actuators.*add_actuator"):
        RobotEnv(rvl.Evolution(arm(1), arm(2)), task=Reach())
    env = RobotEnv(rvl.Evolution(arm(1, "motor"), arm(2, "motor")), alpha=0.5, task=Reach())
    env.reset(seed=0)
    env.step(np.ones(1))
    assert env.simulation.data.qvel[0] > 0


class Wide(Reach):
    """Says that it observes more than it does."""

    def bind(self, model):
        super().bind(model)
        self.observation_size = 3


class Tall(Reach):
    """Gives one reward a robot in a column."""

    def reward(self, robot, before):
        return super().reward(robot, before)[:, None]


@pytest.mark.parametrize("make", [
    lambda task: RobotEnv(puck(), task=task),
    lambda task: rvl.make_vec_env(puck(), 3, task=task),
])  # fmt: skip
def test_a_task_whose_shapes_are_not_what_it_says_is_refused_by_name(make):
    with pytest.raises(SettingsError, match=r"observations of shape \(\d, 2\) from Wide.*, 3\)"):
        make(Wide()).reset(seed=0)
    env = make(Tall())
    env.reset(seed=0)
    with pytest.raises(SettingsError, match=r"rewards of shape \(\d, 1\) from Tall"):
        env.step(np.zeros(env.action_space.shape))
