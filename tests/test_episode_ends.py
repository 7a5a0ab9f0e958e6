"""How episodes end, and what the doors say of it."""

import gymnasium
import numpy as np
import pytest
from natural_puck import Failing, Reach, puck

from revolver_lab.envs import suite
from revolver_lab.envs.core import HUGE, first_look
from revolver_lab.envs.registration import register_environments
from revolver_lab.envs.single import RobotEnv
from revolver_lab.envs.vector import make_vec_env
from revolver_lab.tasks.base import State


@pytest.mark.parametrize(("task", "discount", "push"), [(Reach(), 1.0, 0.0), (Failing(), 0.0, 1.0)])
def test_running_out_of_time_is_discounted_by_nothing_and_failing_by_all(task, discount, push):
    env = suite.SuiteEnv(puck(), task=task, seed=0)
    env.reset()
    env.simulation.data.qpos[0] = 1.0
    steps = [env.step(np.array([push, 0.0])) for _ in range(20)]
    ends = [step for step in steps if step.last()]
    assert ends[0].discount == discount
    assert (len(steps) == 20 and steps[-1].last()) is (discount == 1.0)


def test_a_twin_that_is_moved_begins_a_new_episode():
    env = suite.SuiteEnv(puck(), task=Reach(), seed=0)
    env.reset()
    env.step(np.zeros(2))
    env.set_alpha(1.0)
    assert env.step(np.zeros(2)).first()


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, HUGE, -2 * HUGE])
def test_what_is_no_number_at_a_start_is_shown_as_0(number):
    class Shown(Reach):
        observation_size = 2

    robot = State({"qpos": np.array([[1.5], [number]]), "qvel": np.array([[2.5], [3.5]])})
    seen = first_look(Shown(), robot)
    assert seen.dtype == np.float32
    assert seen.tolist() == [[1.5, 2.5], [0.0, 3.5]]


def test_a_film_of_an_environment_runs_in_its_own_time():
    env = RobotEnv(puck(), task=Reach())  # two steps of 0.05 s each
    assert env.metadata["render_fps"] == 10


@pytest.mark.parametrize(("steps", "success"), [(5, False), (6, True)])
def test_a_goal_has_to_hold_in_more_steps_than_asked_for_behind_both_doors(steps, success):
    one = RobotEnv(puck(), task=Reach())  # whose goal_steps are 5 of 20
    several = make_vec_env(puck(), 2, task=Reach(), seed=0, nthread=1, autoreset_mode="NextStep")
    one.reset(seed=0)
    several.reset(seed=0)
    for t in range(20):
        place = 0.0 if t < steps else 1.0
        one.simulation.data.qpos[:], one.simulation.data.qvel[:] = place, 0.0
        several.batch.bind("qpos")[:], several.batch.bind("qvel")[:] = place, 0.0
        *_, info = one.step(np.zeros(2))
        *_, infos = several.step(np.zeros((2, 2)))
    assert info["episode"]["success"] is success
    assert infos["episode"]["success"].tolist() == [success] * 2
    assert info["episode"]["r"] == steps


def test_what_gymnasium_makes_by_id_has_the_task_and_the_seed_that_were_asked_for():
    register_environments()
    made = gymnasium.make_vec("revolver_lab/CheetahFrontLeg-v0", num_envs=2, alpha=0.5,
                              task="dense", seed=7)  # fmt: skip
    ours = make_vec_env("cheetah-front-leg", 2, alphas=0.5, task="dense", seed=7)
    np.testing.assert_array_equal(made.reset()[0], ours.reset()[0])
    for env in (made, ours):
        env.batch.bind("qvel")[:, 0] = 4.0
    rewards = [env.step(np.zeros((2, 6)))[1] for env in (made, ours)]
    assert rewards[0].all()
    np.testing.assert_array_equal(*rewards)
