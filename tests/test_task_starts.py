"""Where episodes start, and when goals count as held."""

import mujoco
import numpy as np
import pytest

from revolver_lab.robots import registry
from revolver_lab.robots.ball_in_cup import ball_in_cup
from revolver_lab.robots.cheetah import cheetah
from revolver_lab.tasks.catching import Catch
from revolver_lab.tasks.locomotion import AntRun, HumanoidRun
from revolver_lab.tasks.running import RunnerState, SpeedTrap


def starts(task, model, count=300):
    """Positions and velocities of so many starts, (count, nq) and (count, nv)."""
    task.bind(model)
    drawn = [task.initial_state(model, np.random.default_rng(seed)) for seed in range(count)]
    return [np.array(part) for part in zip(*drawn)]


def test_the_run_up_that_a_runner_sees_ends_at_the_trap():
    zeros = np.zeros((5, 9))
    robot = RunnerState({"qpos": zeros.copy(), "qvel": zeros})
    robot.qpos[:, 0] = [-40.0, -5.0, 2.5, 5.0, 40.0]
    task = SpeedTrap()
    task.bind(cheetah().compile())
    assert task.observe(robot)[:, -1].tolist() == [-1, -1, 0.5, 1, 1]


def test_the_trap_asks_for_more_than_its_speed():
    robot = RunnerState({"qpos": np.full((2, 9), 6.0), "qvel": np.zeros((2, 9))})
    robot.qvel[:, 0] = [2.0, np.nextafter(2.0, 3.0)]
    assert SpeedTrap().reward(robot, None).tolist() == [0, 1]


def test_a_runner_starts_at_the_middle_a_tenth_off_its_pose_and_slow():
    model = cheetah().compile()
    qpos, qvel = starts(SpeedTrap(), model)
    off = (qpos - model.qpos0)[:, 2:]
    assert not qpos[:, 0].any()
    assert 0.098 < np.abs(off).max() <= 0.1
    assert off[:, 0].std() == pytest.approx(0.2 / np.sqrt(12), rel=0.15)  # the pitch: no range
    np.testing.assert_allclose(qvel.std(axis=0), 0.1, rtol=0.2)  # 300 starts: 5 errors
    assert np.abs(qvel).max() > 0.25  # normal, and not uniform


def test_a_runner_starts_within_the_ranges_of_its_joints():
    model = cheetah().compile()
    joint = int(np.flatnonzero(model.jnt_limited)[0])
    model.jnt_range[joint] = [0.03, 0.05]
    angle = starts(SpeedTrap(), model, 100)[0][:, model.jnt_qposadr[joint]]
    assert (angle.min(), angle.max()) == (0.03, 0.05)


def test_an_ant_starts_a_tenth_off_its_pose_upright_and_slow():
    model = registry.get("ant-length-mass").source().compile()
    qpos, qvel = starts(AntRun(), model)
    off = np.delete(qpos - model.qpos0, range(3, 7), axis=1)  # all but the quaternion
    assert 0.098 < np.abs(off).max() <= 0.1
    np.testing.assert_allclose(off.std(axis=0), 0.2 / np.sqrt(12), rtol=0.15)
    np.testing.assert_allclose(np.linalg.norm(qpos[:, 3:7], axis=1), 1, rtol=1e-12)
    assert (qpos[:, 4:7].std(axis=0) > 0.04).all()
    np.testing.assert_allclose(qvel.std(axis=0), 0.1, rtol=0.2)
    assert np.abs(qvel).max() > 0.25


def test_a_humanoid_starts_a_hundredth_off_its_pose_upright_and_slow():
    model = registry.get("humanoid-length-mass").source().compile()
    qpos, qvel = starts(HumanoidRun(), model)
    for off in (np.delete(qpos - model.qpos0, range(3, 7), axis=1), qvel):
        assert 0.0098 < np.abs(off).max() <= 0.01
        np.testing.assert_allclose(off.std(axis=0), 0.02 / np.sqrt(12), rtol=0.15)
    np.testing.assert_allclose(np.linalg.norm(qpos[:, 3:7], axis=1), 1, rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "task"), [("ant-length-mass", AntRun()), ("humanoid-length-mass", HumanoidRun())]
)
def test_the_idle_return_is_what_a_robot_earns_that_stands_all_the_time(name, task):
    model = registry.get(name).source().compile()
    task.bind(model)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    data.cfrc_ext[:] = 0.0
    robot = task.state_class({field: getattr(data, field)[None] for field in task.fields})
    step = task.reward(robot, task.remember(robot))[0]
    assert task.idle_return == step * task.episode_steps
    assert SpeedTrap().idle_return == 0.0


def test_the_ball_starts_up_to_two_centimeters_to_either_side():
    model = ball_in_cup(5.0).compile()
    qpos, _ = starts(Catch(), model, 200)
    aside = qpos[:, 2]
    assert 0.019 < aside.max() <= 0.02
    assert -0.02 <= aside.min() < -0.019
