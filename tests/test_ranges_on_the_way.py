"""What an action means, and how long a step is, may change along a path: every door follows."""

import mujoco
import numpy as np
import pytest

from revolver_lab.envs import snapshot
from revolver_lab.envs.core import Controls
from revolver_lab.envs.single import RobotEnv
from revolver_lab.envs.suite import SuiteEnv
from revolver_lab.envs.vector import make_vec_env
from revolver_lab.evolution.evolution import Evolution
from revolver_lab.tasks.base import Task

CART = """<mujoco><option timestep="{timestep}"/><worldbody><body name="cart">
<joint name="x" type="slide" axis="1 0 0" damping=".1"/><geom name="cart" size=".1" mass="1"/>
</body></worldbody><actuator><motor name="push" joint="x" ctrlrange="{low} {high}"/></actuator>
</mujoco>"""
SOURCE = CART.format(timestep=0.002, low=-1, high=1)
TARGET = CART.format(timestep=0.01, low=-1, high=5)
SUBSTEPS, STEPS = 5, 8


class Dash(Task):
    """Rewarded by the mean speed over a step [m/s]."""

    n_substeps, episode_steps = SUBSTEPS, STEPS

    def bind(self, model):
        super().bind(model)
        self.observation_size = 2

    def observe(self, robot):
        return np.concatenate([robot.qpos, robot.qvel], axis=1)

    def remember(self, robot):
        return robot.qpos[:, 0].copy()

    def reward(self, robot, before):
        return (robot.qpos[:, 0] - before) / self.step_seconds

    def initial_state(self, model, rng):
        return np.zeros(1), np.zeros(1)


def by_hand(alpha, action):
    """Rewards of an episode of one action by MuJoCo alone, (STEPS,)."""
    timestep, high = 0.002 + 0.008 * alpha, 1 + 4 * alpha
    model = mujoco.MjModel.from_xml_string(CART.format(timestep=timestep, low=-1, high=high))
    data, rewards = mujoco.MjData(model), []
    for _ in range(STEPS):
        before = data.qpos[0]
        data.ctrl[0] = -1 + (action + 1) / 2 * (high + 1)
        mujoco.mj_step(model, data, SUBSTEPS)
        rewards.append((data.qpos[0] - before) / (timestep * SUBSTEPS))
    return np.array(rewards)


@pytest.mark.parametrize("alpha", [0.0, 0.25, 1.0])
def test_a_single_environment_that_moves_to_another_alpha_takes_its_range_and_its_step(alpha):
    env = RobotEnv(Evolution(SOURCE, TARGET), task=Dash())
    for place in (0.5, alpha):
        env.reset(seed=0, options={"alpha": place})
        rewards = [env.step(np.array([0.4]))[1] for _ in range(STEPS)]
        np.testing.assert_allclose(rewards, by_hand(place, 0.4), rtol=1e-9)


def test_a_vector_of_robots_gives_each_its_own_range_and_step_whatever_the_first_one_is():
    for alphas in ([0.0, 0.5, 1.0], [1.0, 0.5, 0.0]):
        env = make_vec_env(Evolution(SOURCE, TARGET), 3, alphas=[0.0] * 3, task=Dash())
        env.reset(seed=0, options={"alpha": alphas})
        rewards = [env.step(np.full((3, 1), 0.4))[1] for _ in range(STEPS)]
        wanted = np.stack([by_hand(alpha, 0.4) for alpha in alphas], axis=1)
        np.testing.assert_allclose(rewards, wanted, rtol=1e-9)


def test_two_environments_may_share_one_task_and_differ_in_their_steps():
    evolve, task = Evolution(SOURCE, TARGET), Dash()
    envs = {alpha: RobotEnv(evolve, alpha=alpha, task=task) for alpha in (0.0, 1.0)}
    for env in envs.values():
        env.reset(seed=0)
    rewards = [[env.step(np.array([1.0]))[1] for env in envs.values()] for _ in range(STEPS)]
    wanted = np.stack([by_hand(alpha, 1.0) for alpha in envs], axis=1)
    np.testing.assert_allclose(rewards, wanted, rtol=1e-9)


def test_an_environment_put_back_to_another_moment_has_the_ranges_and_steps_of_its_robots():
    evolve, action = Evolution(SOURCE, TARGET), np.full((2, 1), 0.4)
    env, other = (make_vec_env(evolve, 2, task=Dash()) for _ in range(2))
    env.reset(seed=0, options={"alpha": [0.5, 1.0]})
    snapshot.put_back(other, *snapshot.take(env))
    rewards = [other.step(action)[1] for _ in range(STEPS)]
    wanted = np.stack([by_hand(0.5, 0.4), by_hand(1.0, 0.4)], axis=1)
    np.testing.assert_allclose(rewards, wanted, rtol=1e-9)


def test_dm_env_takes_the_range_of_the_alpha_that_it_is_made_at():
    env = SuiteEnv(Evolution(SOURCE, TARGET), alpha=1.0, task=Dash())
    env.reset()
    rewards = [env.step(np.array([0.4])).reward for _ in range(STEPS)]
    np.testing.assert_allclose(rewards, by_hand(1.0, 0.4), rtol=1e-9)


def test_an_action_reaches_exactly_the_ends_of_each_robots_range():
    models = [Evolution(SOURCE, TARGET).model(alpha) for alpha in (0.0, 0.5, 1.0)]
    controls = Controls.each(models)
    ends = [controls(np.full((3, 1), sign), (3, 1))[:, 0] for sign in (-1.0, 1.0)]
    np.testing.assert_array_equal(ends, [[-1, -1, -1], [1, 3, 5]])
