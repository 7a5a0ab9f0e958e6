"""A re-rooted robot moves as the original does."""

import mujoco
import numpy as np
import pytest

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.rerooting import reroot, reroot_state

FLOOR = "<geom name='floor' type='plane' size='5 5 .1'/>"


def random_robot(rng, bodies, *, balls=False, floor=False):
    """A floating tree with up to two joints a body, offsets, turned frames and references."""
    children = {i: [] for i in range(bodies)}
    for i in range(1, bodies):
        children[int(rng.integers(0, i))].append(i)

    def numbers(*values):
        return " ".join(f"{v:.4f}" for v in np.ravel(values))

    motors = []

    def joint(i, k):
        # MuJoCo has no rotation after a ball: a ball stands alone, so that it can be turned round.
        kind = "ball" if balls and i % 2 and k == 0 else rng.choice(["hinge", "slide"])
        name = f"j{i}{k}"
        damping = f"damping='.2' armature='{rng.uniform(0.005, 0.02):.4f}'"
        place = f"pos='{numbers(rng.uniform(-0.1, 0.1, 3))}'"
        if kind == "ball":
            return f"<joint name='{name}' type='ball' {damping} {place} stiffness='1'/>"
        motors.append(f"<motor name='m{name}' joint='{name}' gear='{rng.uniform(-2, 2):.2f}'/>")
        limits = "range='-.4 .5' limited='true'" if kind == "slide" else "range='-100 90'"
        ref = f"ref='{rng.uniform(-0.1, 0.1) if kind == 'slide' else rng.uniform(-40, 40):.3f}'"
        axis = numbers(rng.normal(size=3))
        more = f"axis='{axis}' {limits} {ref} stiffness='3' springref='.1'"
        return f"<joint name='{name}' type='{kind}' {damping} {place} {more}/>"

    def body(i):
        pos = [0, 0, 0.8] if i == 0 else rng.uniform(-0.4, 0.4, 3)
        turn = numbers(rng.uniform(-60, 60, 3))
        count = 2 if rng.random() < 0.4 and not (balls and i % 2) else 1
        joints = "".join(joint(i, k) for k in range(count)) if i else "<freejoint name='f'/>"
        ends = numbers(rng.uniform(-0.15, 0.15, 6))
        geom = (
            f"<geom name='g{i}' type='capsule' fromto='{ends}' size='.05' contype='{int(floor)}'/>"
        )
        below = "".join(body(c) for c in children[i])
        return (
            f"<body name='b{i}' pos='{numbers(pos)}' euler='{turn}'>"
            f"{joints}{geom}<site name='s{i}' pos='.1 0 .05'/>{below}</body>"
        )

    tree = body(0)
    gravity = "0 0 -9.81" if floor else "0 0 0"
    return (
        f"<mujoco><option timestep='.002' gravity='{gravity}' cone='elliptic' tolerance='0'"
        " iterations='300' ls_iterations='100'/>"
        f"<worldbody>{FLOOR if floor else ''}{tree}</worldbody>"
        f"<actuator>{''.join(motors)}</actuator>"
        "<sensor><subtreecom name='com' body='b0'/></sensor></mujoco>"
    )


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
