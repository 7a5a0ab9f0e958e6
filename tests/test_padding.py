"""A padded robot has what the other one has, and moves as if it had not."""

import mujoco
import numpy as np
import pytest
from random_robots import random_robot

import revolver_lab as rvl
from revolver_lab.evolution.lifting import lift
from revolver_lab.evolution.matching import match
from revolver_lab.evolution.padding import pad
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.rerooting import reroot_state

GROUND = "<geom name='floor' type='plane' size='9 9 .1' condim='3'/>"
HEAD = "<mujoco><compiler angle='radian'/><option timestep='.005'/>"


def limb(name, size, below="", *, joint="axis='0 1 0' damping='.3'", motors=None):
    """A capsule with a hinge at its top, as MJCF."""
    turns = f"<joint name='{name}' {joint}/>" if joint else ""
    geom = f"<geom name='{name}' type='capsule' fromto='0 0 0 0 0 -{size}' size='.04'/>"
    return f"<body name='{name}' pos='0 0 -{size}'>{turns}{geom}{below}</body>"


def walker(*, feet=False, ankle="axis='0 1 0' damping='.3'", key=True, tail=""):
    """A floating robot of two legs with motors; with feet, or with ankles, or without."""
    legs, motors = "", ""
    for side, y in (("l", 0.1), ("r", -0.1)):
        foot = limb(f"foot_{side}", 0.2) if feet else ""
        leg = limb(f"thigh_{side}", 0.2, limb(f"shin_{side}", 0.2, foot, joint=ankle))
        legs += leg.replace("pos='0 0 -0.2'", f"pos='0 {y} 0'", 1)
        names = [f"thigh_{side}", f"shin_{side}" if ankle else "", f"foot_{side}" if feet else ""]
        motors += "".join(f"<motor name='{n}' joint='{n}' gear='4'/>" for n in names if n)
    body = f"<geom name='torso' type='box' size='.1 .15 .05'/>{legs}{tail}"
    keyframe = "<keyframe><key name='up' qpos='0 0 1 1 0 0 0 .1 .2 .3 .4'/></keyframe>"
    return (
        f"{HEAD}<worldbody>{GROUND}<body name='torso' pos='0 0 1'><freejoint name='root'/>{body}"
        f"</body></worldbody><actuator>{motors}</actuator>"
        f"{keyframe if key and not feet and ankle else ''}</mujoco>"
    )


def padded(a, b):
    """Two robots from XML, and the padded pair."""
    source, target = read_robot(a), read_robot(b)
    return source, target, pad(source, target, match(source, target))


def apart(robot, twin, steps, *, ground, seed=0):
    """Largest difference in qpos between a robot and its padded twin, after each step."""
    places = lift(robot, twin)
    models, data = (robot, twin), (mujoco.MjData(robot), mujoco.MjData(twin))
    rng, found = np.random.default_rng(seed), []
    data[1].qpos[:], data[1].qvel[:] = places.state(data[0].qpos, data[0].qvel)
    for model in models:
        model.opt.gravity[2] = -9.81 if ground else 0.0
    for step in range(steps):
        if step % 10 == 0:
            control = rng.uniform(-1, 1, robot.nu)
            data[1].ctrl[:] = rng.uniform(-1, 1, twin.nu)
        data[0].ctrl[:], data[1].ctrl[places.ctrl] = control, control
        for model, state in zip(models, data):
            mujoco.mj_step(model, state)
        found.append(np.abs(data[0].qpos - data[1].qpos[places.qpos]).max())
    return np.array(found)


def same_arrays(a, b):
    for attribute in dir(a):
        value = getattr(a, attribute)
        if isinstance(value, np.ndarray) and not attribute.startswith("_"):
            np.testing.assert_array_equal(value, getattr(b, attribute), attribute)


def test_where_nothing_is_created_both_robots_compile_to_equal_arrays():
    a, b = walker(), walker().replace("gear='4'", "gear='7'").replace("0 -0.2", "0 -0.3")
    source, target, twins = padded(a, b)
    same_arrays(source.compile(), twins.source.compile())
    same_arrays(target.compile(), twins.target.compile())


def test_with_feet_created_the_robot_flies_as_before():
    source, _, twins = padded(walker(), walker(feet=True))
    error = apart(source.compile(), twins.source.compile(), 1000, ground=False)
    assert error.max() < 1e-9


def test_with_feet_created_the_robot_falls_and_lies_as_before():
    source, _, twins = padded(walker(), walker(feet=True))
    error = apart(source.compile(), twins.source.compile(), 300, ground=True)
    assert error[:200].max() < 1e-8  # longer, contact is chaotic
    assert error.max() < 1e-3


def test_with_ankles_created_in_welded_legs_the_robot_moves_as_before():
    source, _, twins = padded(walker(ankle=""), walker())
    model = twins.source.compile()
    assert model.njnt == 5
    error = apart(source.compile(), model, 300, ground=False)
    assert error[:100].max() < 1e-5
    assert error.max() < 1e-4


def test_the_target_moves_as_before_too():
    _, target, twins = padded(walker(feet=True), walker())
    error = apart(target.compile(), twins.target.compile(), 300, ground=True)
    assert error[:200].max() < 1e-8


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (walker(), walker(feet=True)),
        (walker(feet=True), walker(ankle="")),
        (walker(), walker(feet=True, tail=limb("tail", 0.3, joint="type='slide' axis='1 0 0'"))),
        (walker(), walker(tail=limb("tail", 0.3, joint="type='ball' damping='.1'"))),
    ],
)
def test_both_sides_have_the_same_elements_and_every_pair_exists(a, b):
    _, _, twins = padded(a, b)
    models = twins.source.compile(), twins.target.compile()
    for size in ("nbody", "nq", "nv", "nu", "njnt", "ngeom", "nsite"):
        assert getattr(models[0], size) == getattr(models[1], size), size
    for kind, spec_list in (("body", "bodies"), ("joint", "joints"), ("actuator", "actuators")):
        pairs = twins.pairs[kind]
        for side, spec in enumerate((twins.source, twins.target)):
            names = [e.name for e in getattr(spec, spec_list) if e.name != "world"]
            assert sorted(names) == sorted(pair[side] for pair in pairs)


def test_what_was_there_keeps_its_mass_and_place():
    source, _, twins = padded(walker(), walker(feet=True))
    model, twin = source.compile(), twins.source.compile()
    for i in range(1, model.nbody):
        ours, theirs = model.body(i), twin.body(model.body(i).name)
        np.testing.assert_allclose(ours.mass, theirs.mass, rtol=1e-12)
        np.testing.assert_allclose(ours.pos, theirs.pos, atol=1e-15)
    assert twin.body("foot_l").mass < 1e-12


def test_keyframes_reach_over_what_was_created():
    source, _, twins = padded(walker(), walker(feet=True))
    model, twin = source.compile(), twins.source.compile()
    np.testing.assert_array_equal(twin.key_qpos[0][lift(model, twin).qpos], model.key_qpos[0])


def test_masses_inferred_from_geoms_by_force_stay():
    a = walker().replace("<compiler ", "<compiler inertiafromgeom='true' ")
    source, _, twins = padded(a, walker(feet=True))
    error = apart(source.compile(), twins.source.compile(), 100, ground=False)
    assert error.max() < 1e-9


def test_a_rerooted_target_flies_as_before():
    branch = "<body name='{0}'><joint name='{0}' axis='0 1 0'/><geom size='.1'/></body>"
    chain = "<body name='a'><freejoint name='f'/><geom size='.1'/><body name='b' pos='.3 0 0'>"
    chain += "<joint name='b' axis='0 1 0'/><geom size='.1'/>" + branch.format("c")
    chain += "</body></body>"
    chain = chain.replace("name='c'>", "name='c' pos='.3 0 0'>")
    star = "<body name='m'><freejoint name='f'/><geom size='.1'/>"
    star += branch.format("p").replace("'>", "' pos='.3 0 0'>", 1)
    star += branch.format("q").replace("'>", "' pos='-.3 0 0'>", 1) + "</body>"
    a, b = (f"{HEAD}<worldbody>{robot}</worldbody></mujoco>" for robot in (chain, star))
    source, target, twins = padded(a, b)
    same_arrays(source.compile(), source.compile())
    before, after = target.compile(), twins.target.compile()
    data = mujoco.MjData(before), mujoco.MjData(after)
    data[0].qvel[:] = np.random.default_rng(0).normal(size=before.nv)
    data[1].qpos[:], data[1].qvel[:] = reroot_state(before, after, data[0].qpos, data[0].qvel)
    for model, state in zip((before, after), data):
        model.opt.gravity[:] = 0.0
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        for _ in range(100):
            mujoco.mj_step(model, state)
        mujoco.mj_kinematics(model, state)
    for name in ("m", "p", "q"):
        np.testing.assert_allclose(data[0].body(name).xpos, data[1].body(name).xpos, atol=1e-6)


@pytest.mark.parametrize("seed", range(16))
def test_any_two_floating_robots_can_be_padded_and_the_source_moves_as_before(seed):
    rng = np.random.default_rng(seed)
    a, b = (
        random_robot(rng, int(rng.integers(1, 7)), balls=seed % 3 == 0, floor=seed % 2 == 0)
        for _ in range(2)
    )
    source, _, twins = padded(a, b)
    models = twins.source.compile(), twins.target.compile()
    assert models[0].nq == models[1].nq
    assert models[0].nu == models[1].nu
    model = source.compile()
    assert apart(model, models[0], 60, ground=False).max() < 1e-4


def test_meshes_defaults_tendons_and_constraints_come_along(tmp_path):
    corners = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "tip.obj").write_text(corners)
    hand = (
        "<body name='hand' pos='0 0 .3'><joint name='wrist' class='arm'/><geom mesh='tip'"
        " class='skin'/><body name='f' pos='.05 0 .1'><joint name='f' type='slide'"
        " range='0 .04'/><geom type='box' size='.01 .01 .03'/></body></body>"
    )
    robot = (
        "<mujoco><compiler autolimits='true'/><default><default class='arm'>"
        "<joint damping='1' armature='.1' axis='0 1 0'/><position kp='50'/>"
        "<default class='skin'><geom type='mesh' material='red'/></default></default></default>"
        "<asset><material name='red'/><mesh name='tip' file='tip.obj'/></asset><worldbody>"
        "<body name='base' childclass='arm'><joint name='turn'/><geom class='skin' mesh='tip'/>{}"
        "</body></worldbody>{}<actuator><position class='arm' name='turn' joint='turn'/></actuator>"
        "</mujoco>"
    )
    rest = (
        "<tendon><fixed name='t'><joint joint='turn' coef='1'/><joint joint='f' coef='2'/></fixed>"
        "</tendon><equality><joint joint1='f' joint2='wrist' polycoef='0 .1 0 0 0'/></equality>"
        "<sensor><jointpos name='felt' joint='wrist'/></sensor>"
        "<actuator><motor name='pull' tendon='t'/></actuator>"
    )
    for name, text in (("a", robot.format("", "")), ("b", robot.format(hand, rest))):
        (tmp_path / f"{name}.xml").write_text(text)
    source, target = read_robot(tmp_path / "a.xml"), read_robot(tmp_path / "b.xml")
    twins = pad(source, target, match(source, target))
    models = twins.source.compile(), twins.target.compile()
    for size in ("nbody", "ntendon", "neq", "nsensor", "nu", "ngeom"):
        assert getattr(models[0], size) == getattr(models[1], size), size
    assert len(twins.pairs["mesh"]) == 2
    assert apart(source.compile(), models[0], 300, ground=False).max() < 1e-6


@pytest.mark.parametrize("back", [False, True])
def test_a_mesh_that_encloses_next_to_nothing_is_created(back):
    # Slivers that are far apart: little area, and a large box around it.
    places = ((0, 0.01), (0, -0.011), (0.009, 0), (-0.006, -0.002))
    corners = " ".join(
        f"5e-4 {y + 2e-5} {z - 2e-5} 5e-4 {y} {z + 2e-5} -5e-4 {y} {z}" for y, z in places
    )
    faces = " ".join(f"{i} {i + 1} {i + 2}" for i in range(0, 3 * len(places), 3))
    sheet = f"<mesh name='sheet' vertex='{corners}' face='{faces}'/>"
    drawn = "<geom name='sheet' type='mesh' mesh='sheet' contype='0' conaffinity='0'/>"
    inertia = "<inertial pos='0 0 0' mass='1' diaginertia='.1 .1 .1'/>"

    def arm(asset="", geom=""):
        return (f"<mujoco><asset>{asset}</asset><worldbody><body name='arm'>{inertia}"
                f"<joint name='turn'/>{geom}</body></worldbody></mujoco>")  # fmt: skip

    robots = [arm(), arm(sheet, drawn)]
    evolve = rvl.Evolution(*(robots[::-1] if back else robots))
    absent, there = (evolve.model(float(alpha)) for alpha in (back, not back))
    sizes = [np.ptp(model.mesh_vert, axis=0).max() for model in (absent, there)]
    assert sizes[0] < 0.2 * sizes[1]
