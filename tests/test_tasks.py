"""Tasks, against formulas written out again and against Gym's own environments."""

import gymnasium
import mujoco
import numpy as np
import pytest

from revolver_lab.robots import registry
from revolver_lab.robots.ball_in_cup import ball_in_cup
from revolver_lab.robots.cheetah import cheetah
from revolver_lab.robots.cheetah_segment import cheetah_with_segment
from revolver_lab.tasks.base import normalized_root
from revolver_lab.tasks.catching import Catch, CupState, Toss
from revolver_lab.tasks.locomotion import AntRun, HumanoidRun
from revolver_lab.tasks.running import Dash, RunnerState, SpeedTrap


def bound(task, model):
    """The task and its robot of one, on new data."""
    task.bind(model)
    data = mujoco.MjData(model)
    return data, task.state_class({field: getattr(data, field)[None] for field in task.fields})


def runner(x, speed):
    zeros = np.zeros((len(x), 9))
    robot = RunnerState({"qpos": zeros.copy(), "qvel": zeros.copy()})
    robot.qpos[:, 0], robot.qvel[:, 0] = x, speed
    return robot


def test_the_speed_trap_pays_one_beyond_five_meters_above_two_meters_a_second():
    robot = runner([4.9, 5.1, 5.1, 5.0, 9.0], [9.0, 2.1, 1.9, 9.0, 8.0])
    assert SpeedTrap().reward(robot, None).tolist() == [0, 1, 0, 0, 1]


def test_the_dash_pays_speed_over_eight_meters_a_second_clipped():
    robot = runner([0, 0, 0, 0], [4.0, 8.0, 20.0, -20.0])
    assert Dash().reward(robot, None).tolist() == [0.5, 1, 1, -1]


def test_a_runner_sees_everything_but_x_and_how_far_its_run_up_is():
    task = SpeedTrap()
    data, robot = bound(task, cheetah().compile())
    data.qpos[:], data.qvel[:] = np.arange(9.0) + 2.5, np.arange(9.0)
    seen = task.observe(robot)[0]
    assert seen[:8].tolist() == data.qpos[1:].tolist()
    np.testing.assert_allclose(seen[8:17], data.qvel / 10)
    assert seen[17] == 0.5
    assert task.observation_size == seen.size == 18


def test_running_takes_ten_seconds():
    task = SpeedTrap()
    task.bind(cheetah().compile())
    assert task.step_seconds * task.episode_steps == pytest.approx(10)


@pytest.mark.parametrize("factors", [(1, 1), (0.4, 1), (0.5, 0.5), (1.8, 1.8)])
def test_a_cheetah_of_any_legs_starts_one_centimeter_above_the_ground(factors):
    model = cheetah(*factors).compile()
    task = SpeedTrap()
    data, _ = bound(task, model)
    for seed in range(5):
        data.qpos[:], data.qvel[:] = task.initial_state(model, np.random.default_rng(seed))
        for drop, touches in ((0.0, False), (0.009, False), (0.002, True)):
            data.qpos[1] -= drop
            mujoco.mj_forward(model, data)
            assert any("ground" in _pair(model, c) for c in data.contact) is touches


@pytest.mark.parametrize("k", [0.02, 0.5, 1.0])
def test_a_cheetah_with_a_segment_starts_one_centimeter_above_the_ground(k):
    model = cheetah_with_segment(k).compile()
    task = SpeedTrap()
    data, _ = bound(task, model)
    for seed in range(3):
        data.qpos[:], data.qvel[:] = task.initial_state(model, np.random.default_rng(seed))
        for drop, touches in ((0.009, False), (0.002, True)):
            data.qpos[1] -= drop
            mujoco.mj_forward(model, data)
            assert any("ground" in _pair(model, c) for c in data.contact) is touches


def _pair(model, contact):
    return [model.geom(i).name for i in contact.geom]


def test_starts_draw_the_same_numbers_on_every_robot():
    draws = []
    for model in (cheetah().compile(), cheetah(1.8, 0.4, 2).compile()):
        task, rng = SpeedTrap(), np.random.default_rng(7)
        task.bind(model)
        qpos, qvel = task.initial_state(model, rng)
        draws.append((np.delete(qpos, 1), qvel, rng.random()))
    np.testing.assert_array_equal(draws[0][0], draws[1][0])
    np.testing.assert_array_equal(draws[0][1], draws[1][1])
    assert draws[0][2] == draws[1][2]


def landed(name, task, seed):
    """A source robot that has just touched the ground under random controls, all current."""
    model = registry.get(name).source().compile()
    data, robot = bound(task, model)
    rng = np.random.default_rng(seed)
    data.qpos[:], data.qvel[:] = task.initial_state(model, rng)
    for _ in range(200):
        data.ctrl[:] = rng.uniform(*model.actuator_ctrlrange.T)
        mujoco.mj_step(model, data, 5)
        mujoco.mj_forward(model, data)
        if np.abs(data.cfrc_ext).max() > 1:
            return data, robot
    raise AssertionError("the robot should touch the ground")


@pytest.mark.parametrize(
    ("name", "gym_id", "options", "task"),
    [
        ("ant-length-mass", "Ant-v4", {"use_contact_forces": True}, AntRun()),
        ("humanoid-length-mass", "Humanoid-v4", {}, HumanoidRun()),
    ],
)
@pytest.mark.filterwarnings("ignore")
def test_an_observation_is_gyms_of_the_same_state(name, gym_id, options, task):
    data, robot = landed(name, task, 0)
    env = gymnasium.make(gym_id, disable_env_checker=True, **options).unwrapped
    theirs = env.data
    theirs.ctrl[:] = data.ctrl
    theirs.qacc_warmstart[:] = data.qacc_warmstart
    env.set_state(data.qpos, data.qvel)
    mujoco.mj_rnePostConstraint(env.model, theirs)
    expected = env._get_obs()
    np.testing.assert_allclose(task.observe(robot)[0], expected, rtol=1e-6, atol=1e-6)
    assert task.observation_size == expected.size


def test_the_ants_reward_is_its_formula():
    task = AntRun()
    data, robot = landed("ant-length-mass", task, 1)
    before = np.array([data.qpos[0] - 0.1])
    forces = np.clip(data.cfrc_ext, -1, 1)
    expected = 0.1 / 0.05 + 1 - 0.5 * (data.ctrl**2).sum() - 5e-4 * (forces**2).sum()
    assert task.reward(robot, before)[0] == pytest.approx(expected)


def test_the_humanoids_reward_is_its_formula():
    task = HumanoidRun()
    data, robot = landed("humanoid-length-mass", task, 1)
    mass = registry.get("humanoid-length-mass").source().compile().body_mass
    center = mass @ data.xipos[:, 0] / mass.sum()
    contact = min(5e-7 * (data.cfrc_ext**2).sum(), 10)
    expected = 1.25 * 0.03 / 0.015 + 5 - 0.1 * (data.ctrl**2).sum() - contact
    assert task.reward(robot, np.array([center - 0.03]))[0] == pytest.approx(expected)


def test_the_humanoids_contact_cost_is_at_most_ten():
    task = HumanoidRun()
    data, robot = landed("humanoid-length-mass", task, 1)
    rest = task.reward(robot, task.remember(robot)) + 5e-7 * (data.cfrc_ext**2).sum()
    data.cfrc_ext[:] = 1e9
    np.testing.assert_allclose(task.reward(robot, task.remember(robot)), rest - 10)


@pytest.mark.parametrize(
    ("name", "task", "heights"),
    [
        ("ant-length-mass", AntRun(), {0.19: True, 0.21: False, 0.99: False, 1.01: True}),
        ("humanoid-length-mass", HumanoidRun(), {0.99: True, 1.01: False, 1.99: False, 2.01: True}),
    ],
)
def test_a_walker_ends_outside_its_heights(name, task, heights):
    data, robot = bound(task, registry.get(name).source().compile())
    for height, over in heights.items():
        data.qpos[2] = height
        assert bool(task.terminated(robot)[0]) is over
    data.qpos[2] = np.nan
    assert task.terminated(robot)[0]


def test_what_is_remembered_survives_the_step():
    data, robot = bound(AntRun(), registry.get("ant-length-mass").source().compile())
    before = AntRun().remember(robot)
    data.qpos[0] = 3.0
    assert before[0] == 0.0


def test_a_start_has_a_unit_quaternion():
    qpos = normalized_root(np.arange(9.0))
    assert np.linalg.norm(qpos[3:7]) == pytest.approx(1)
    assert qpos[[0, 1, 2, 7, 8]].tolist() == [0, 1, 2, 7, 8]


def cups(n, seed=0):
    """n balls in and around the cup, which is anywhere."""
    rng = np.random.default_rng(seed)
    qpos = rng.uniform(-0.3, 0.3, (n, 4))
    qpos[:, 2:] = qpos[:, :2] + rng.uniform([-0.05, 0.3], [0.05, 0.4], (n, 2))  # cup: 0.35 above
    return CupState({"qpos": qpos, "qvel": rng.normal(size=(n, 4))})


@pytest.mark.parametrize("gear", [5.0, 2.5])
@pytest.mark.filterwarnings("ignore")
def test_the_ball_is_caught_where_dm_controls_in_target_says_so(gear):
    from dm_control.suite import ball_in_cup as theirs

    physics = theirs.Physics.from_xml_string(*theirs.get_model_and_assets())
    task = Catch()
    task.bind(ball_in_cup(gear).compile())
    robot = cups(500)
    expected = []
    for qpos in robot.qpos:
        physics.data.qpos[:] = qpos
        mujoco.mj_kinematics(physics.model.ptr, physics.data.ptr)
        expected.append(physics.in_target())
    assert task.reward(robot, None).tolist() == expected
    assert 50 < sum(expected) < 450


def test_the_toss_pays_the_catch_and_half_the_height_below_the_rim():
    catch, toss = Catch(), Toss()
    for task in (catch, toss):
        task.bind(ball_in_cup(5.0).compile())
    robot = cups(4)
    cup_z = robot.qpos[:, 1]
    below = np.array([0.4, 0.3, 0.15, 0.0])  # of the rim, which is 0.4 m above the ball's place
    robot.qpos[:, 3] = cup_z + 0.4 - below
    height = toss.reward(robot, None) - catch.reward(robot, None)
    np.testing.assert_allclose(height, [0, 0, 0.25, 0.5], atol=1e-12)
    robot.qpos[:, 3] += 1.0
    np.testing.assert_allclose(toss.reward(robot, None), [0.5] * 4)


def test_the_cups_player_sees_positions_times_three_and_velocities_times_three_tenths():
    task, robot = Toss(), cups(3)
    task.bind(ball_in_cup(5.0).compile())
    seen = task.observe(robot)
    np.testing.assert_allclose(seen, np.hstack([3 * robot.qpos, 0.3 * robot.qvel]))
    assert task.observation_size == seen.shape[1] == 8
    assert task.step_seconds * task.episode_steps == pytest.approx(4)


def test_the_ball_starts_below_the_cup_on_a_slack_string_at_rest():
    model = ball_in_cup(5.0).compile()
    task = Catch()
    data, robot = bound(task, model)
    below, aside = [], []
    for seed in range(50):
        data.qpos[:], data.qvel[:] = task.initial_state(model, np.random.default_rng(seed))
        mujoco.mj_forward(model, data)
        apart = data.site("cup").xpos - data.body("ball").xpos
        below.append(apart[2])
        aside.append(abs(apart[0]))
        assert data.ncon == 0
        assert data.ten_length[0] < 0.15 < model.tendon_range[0, 1]
        assert not data.qvel.any()
        assert not task.reward(robot, None).any()
    assert 0.07 <= min(below) < 0.08
    assert 0.09 < max(below) <= 0.10
    assert max(aside) <= 0.02
