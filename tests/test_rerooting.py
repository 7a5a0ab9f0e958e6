"""A re-rooted robot moves as the original does."""

import re

import mujoco
import numpy as np
import pytest
from random_robots import random_robot

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.rerooting import reroot, reroot_state


def rollout_apart(first, second, rng, steps):
    """Largest distance between the same bodies and sites of two robots under equal controls [m]."""
    models = first, second
    data = [mujoco.MjData(m) for m in models]
    data[0].qvel[:] = rng.normal(size=first.nv) * 0.3
    qpos, qvel = reroot_state(first, second, data[0].qpos, data[0].qvel)
    data[1].qpos[:], data[1].qvel[:] = qpos, qvel
    names = [first.body(i).name for i in range(1, first.nbody)]
    order = [[m.actuator(first.actuator(i).name).id for i in range(first.nu)] for m in models]
    apart = []
    for _ in range(steps):
        control = rng.uniform(-1, 1, first.nu)
        for m, d, index in zip(models, data, order):
            d.ctrl[index] = control
            mujoco.mj_step(m, d)
        for m, d in zip(models, data):
            mujoco.mj_kinematics(m, d)
        places = [np.array([d.body(n).xpos for n in names]) for d in data]
        turns = [np.array([d.body(n).xmat for n in names]) for d in data]
        apart.append(max(np.abs(places[0] - places[1]).max(), np.abs(turns[0] - turns[1]).max()))
    return np.array(apart)


@pytest.mark.parametrize("seed", range(12))
def test_in_free_flight_the_rerooted_robot_moves_as_the_original(seed):
    rng = np.random.default_rng(seed)
    bodies = int(rng.integers(3, 7))
    spec = read_robot(random_robot(rng, bodies, balls=seed % 3 == 2))
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    moved = reroot(spec, f"b{bodies - 1}")
    apart = rollout_apart(spec.compile(), moved.compile(), rng, 200)
    # Rotations about the root integrate differently from rotations about a leaf: RK4's error.
    assert apart[:20].max() < 1e-6
    assert apart.max() < 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_with_contact_the_rerooted_robot_moves_as_the_original(seed):
    rng = np.random.default_rng(seed)
    spec = read_robot(random_robot(rng, 4, floor=True))
    spec.option.timestep = 2.5e-4
    moved = reroot(spec, "b3")
    apart = rollout_apart(spec.compile(), moved.compile(), rng, 400)
    assert apart.max() < 5e-3


@pytest.mark.parametrize("contact", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_forces_accelerate_the_rerooted_robot_as_the_original(seed, contact):
    rng = np.random.default_rng(seed)
    spec = read_robot(random_robot(rng, 5, balls=True, floor=True))
    models = spec.compile(), reroot(spec, "b4").compile()
    data = [mujoco.MjData(m) for m in models]
    for i in range(models[0].njnt):
        if models[0].jnt_type[i] in (2, 3):
            data[0].qpos[models[0].jnt_qposadr[i]] += rng.normal() * 0.2
    data[0].qpos[2] += -0.5 if contact else 5.0
    # MuJoCo's contacts leave out dJ/dt v, which depends on the coordinates: so v = 0 with contact.
    data[0].qvel[:] = 0.0 if contact else rng.normal(size=models[0].nv)
    state = reroot_state(*models, data[0].qpos, data[0].qvel)
    data[1].qpos[:], data[1].qvel[:] = state
    accelerations = []
    for m, d in zip(models, data):
        m.opt.disableflags |= 0 if contact else int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        for i in range(m.nu):
            d.actuator(m.actuator(i).name).ctrl[:] = np.sin(int(m.actuator(i).name[2:]))
        d.ctrl[:] = 0.7
        mujoco.mj_forward(m, d)
        mujoco.mj_rnePostConstraint(m, d)
        found = []
        for i in range(5):
            out = np.empty(6)
            mujoco.mj_objectAcceleration(
                m, d, mujoco.mjtObj.mjOBJ_XBODY, m.body(f"b{i}").id, out, 0
            )
            found.append(out)
        accelerations.append(np.array(found))
    scale = np.abs(accelerations[0]).max()
    np.testing.assert_allclose(accelerations[0], accelerations[1], atol=1e-5 * scale)
    np.testing.assert_allclose(data[0].sensor("com").data, data[1].sensor("com").data, atol=1e-12)


def test_rerooting_there_and_back_gives_the_same_robot():
    spec = read_robot(random_robot(np.random.default_rng(3), 5))
    back = reroot(reroot(spec, "b4"), "b0").compile()
    model = spec.compile()
    for joint in range(model.njnt):
        name = model.joint(joint).name
        np.testing.assert_allclose(model.joint(name).axis, back.joint(name).axis, atol=1e-12)
        np.testing.assert_allclose(model.joint(name).pos, back.joint(name).pos, atol=1e-12)


def test_a_body_that_does_not_float_cannot_be_a_root():
    fixed = "<mujoco><worldbody><body name='a'><geom size='.1'/></body></worldbody></mujoco>"
    with pytest.raises(MatchingError, match="free joint"):
        reroot(read_robot(fixed), "a")


def stretched(text):
    """The same robot with quaternions of length two in place of Euler angles."""
    rng = np.random.default_rng(1)

    def quat(_):
        turn = rng.standard_normal(4)
        return f"quat='{' '.join(f'{x:.4f}' for x in 2 * turn / np.linalg.norm(turn))}'"

    return re.sub("euler='[^']*'", quat, text)


@pytest.mark.parametrize("write", [stretched, lambda text: text.replace(
    "<freejoint name='f'/>", "<freejoint name='f' align='true'/>")])  # fmt: skip
def test_frames_that_are_long_or_aligned_reroot_as_well(write):
    rng = np.random.default_rng(0)
    spec = read_robot(write(random_robot(rng, 5)))
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    moved = reroot(spec, "b4")
    assert rollout_apart(spec.compile(), moved.compile(), rng, 20).max() < 1e-6


def test_a_sensor_of_the_old_root_alone_stays_with_it():
    text = random_robot(np.random.default_rng(2), 4)
    felt = "<framepos name='where' objtype='body' objname='b0'/></sensor>"
    host = reroot(read_robot(text.replace("</sensor>", felt)), "b3")
    assert host.sensor("where").objname == "b0"
    assert host.sensor("com").objname == "b3"  # of the whole robot: it follows the root


def test_a_ball_joint_that_is_driven_is_not_turned_round():
    link = "<body name='{0}' pos='.3 0 0'>{1}<geom size='.1'/>{2}</body>"
    arm = link.format("b", "<joint name='j' type='ball'/>", "")
    body = link.format("a", "<freejoint name='f'/>", arm)
    text = (f"<mujoco><worldbody>{body}</worldbody><actuator><motor name='m' joint='j'"
            " gear='1 0 0'/></actuator></mujoco>")  # fmt: skip
    with pytest.raises(MatchingError, match="the actuator 'm' on the ball joint 'j'"):
        reroot(read_robot(text), "b")


def test_a_keyframe_without_velocities_is_still_one_after_rerooting():
    text = random_robot(np.random.default_rng(4), 3)
    model = mujoco.MjModel.from_xml_string(text)
    places = " ".join(f"{x:.6f}" for x in model.qpos0)
    key = f"<keyframe><key name='k' time='2' qpos='{places}'/></keyframe></mujoco>"
    moved = reroot(read_robot(text.replace("</mujoco>", key)), "b2").compile()
    assert (moved.nkey, moved.key_time[0]) == (1, 2)
    assert not moved.key_qvel[0].any()
    data = mujoco.MjData(moved), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(moved, data[0], 0)
    for state in data:
        mujoco.mj_kinematics(state.model, state)
    for name in ("b0", "b1", "b2"):
        np.testing.assert_allclose(data[0].body(name).xpos, data[1].body(name).xpos, atol=1e-5)
