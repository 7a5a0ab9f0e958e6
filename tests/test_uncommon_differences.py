"""What few robots differ in: both ends move as the two robots, or the difference is refused."""

import mujoco
import numpy as np
import pytest
from test_padding import apart
from test_uncommon_parts import OVER, link, robot, shaken, tendon

import revolver_lab as rvl
from revolver_lab.errors import ParameterError
from revolver_lab.evolution.parameters import CONTINUOUS, DISCRETE


def ball(more=""):
    return f"<geom name='x' size='.02' pos='.2 0 -.9' {more}/>"


def box(at, joints="<freejoint name='r'/>"):
    return (
        f"<mujoco><worldbody><body name='b' pos='0 0 1'>{joints}<geom name='g' type='box'"
        f" size='.1 .2 .3' pos='{at}'/></body></worldbody></mujoco>"
    )


def muscle(more="", low=60):
    return robot(joint=f"range='-{low} 60'", motors=f"<muscle name='m' joint='f1' {more}/>")


def held(more, z):
    key = f"<keyframe><key name='k' qpos='.1 .2 .3 .4' {more}/></keyframe>"
    place = f"<body name='m' mocap='true' pos='1 0 {z}'/>" if z is not None else ""
    return robot(scene=place, rest=key)


def slide(axis):
    joints = "<joint name='x' type='slide' axis='1 0 0'/>"
    return box("0 0 0", joints + f"<joint name='y' type='slide' axis='{axis}'/>")


FLOATS = "<joint name='f3' axis='0 1 0'/>"
OVERRIDE = "<option o_solref='{} 1'><flag override='enable'/></option>"
DIFFERENCES = {
    "weightlessness": [robot(tip=link(FLOATS, more=m)) for m in ("", "gravcomp='.5'")],
    "a moving surface": [robot(tip=ball(m)) for m in ("", "surfacevel='1 0 0 0 0 0'")],
    "glue": [robot(tip=ball(m)) for m in ("", "adhesion='3'")],
    "glue between two": [
        robot(rest=f"<contact><pair name='p' geom1='f2' geom2='floor' {m}/></contact>")
        for m in ("", "adhesion='2' margin='.9' gap='.1'")
    ],
    "a pulley's divisor": [
        robot(rest=tendon(f"<site site='s0'/><site site='s1'/><pulley divisor='{d}'/>"
                          + OVER.format("")))
        for d in (2, 3)
    ],
    "a muscle's force, stated by one": [muscle(), muscle("force='30'")],
    "a muscle's lengths, stated by one": [muscle(), muscle("lengthrange='-.5 .5'")],
    "a muscle's joint": [muscle(low=60), muscle(low=30)],
    "overridden contacts": [robot(head=OVERRIDE.format(s)) for s in (0.02, 0.05)],
    "a delay": [
        robot(motors=f"<position name='q' joint='f1' kp='5' nsample='10' delay='{d}'/>")
        for d in (0.002, 0.01)
    ],
    "a servo of a velocity": [
        robot(motors=f"<pid name='p' joint='f2' kp='9' kv='.7' input='vel' velrange='-{r} {r}'/>")
        for r in (0.5, 0.8)
    ],
    "the places of a keyframe": [
        held(f"mpos='0 0 {z}' mquat='1 0 0 {z}'", 0.5) for z in (0, 1)
    ],
    "a place only one has": [held("", None), held("mpos='0 0 1'", 0.5)],
    "a controlled key": [held("", None), held("ctrl='.5' qvel='0 1 0 0'", None)],
    "the middle of a single body": [box("0 0 0"), box(".1 .2 .05")],
    "the axis of a sledge": [slide("0 1 0"), slide("0 0 1")],
    "a medium": [robot(head=f"<option density='{d}' viscosity='.1'/>") for d in (0, 1000)],
    "damping by powers of the speed": [robot(joint=j) for j in ("", "stiffness='1 2 3'")],
}  # fmt: skip


@pytest.mark.parametrize("name", DIFFERENCES)
def test_both_ends_move_as_the_two_robots_and_nothing_bursts_between(name):
    texts = DIFFERENCES[name]
    evolve = rvl.Evolution(*texts)
    assert evolve.theta_changed.any()
    for alpha, text in enumerate(texts):
        alone = shaken(mujoco.MjModel.from_xml_string(text))
        np.testing.assert_allclose(shaken(evolve.model(alpha)), alone, atol=1e-9)
    for alpha in np.linspace(0.1, 0.9, 5):
        shaken(evolve.model(alpha))


@pytest.mark.parametrize("name", ["weightlessness", "glue", "a moving surface"])
def test_what_is_absent_at_first_acts_in_between(name):
    one, other = DIFFERENCES[name]
    evolve = rvl.Evolution(one, other)
    without, half = (shaken(evolve.model(alpha)) for alpha in (0.0, 0.5))
    assert np.abs(without - half).max() > 1e-7


@pytest.mark.parametrize(
    ("attribute", "values", "what"),
    [("nsample", ("5", "10"), "nhistory"), ("dyntype", ("none", "user' actdim='2"), "na = 2")],
)
def test_a_switch_that_changes_how_much_there_is_is_refused_at_once(attribute, values, what):
    made = [
        robot(motors=f"<general name='q' joint='f1' {attribute}='{v}' dynprm='.1' delay='.002'"
              f" {'nsample=' + chr(39) + '5' + chr(39) if attribute != 'nsample' else ''}/>")
        for v in values
    ]  # fmt: skip
    with pytest.raises(ParameterError, match=f"q/{attribute}"):
        rvl.Evolution(*made)
    with pytest.raises(ParameterError, match=what):
        rvl.Evolution(*made, switch=0.5)


def test_a_servo_of_several_controls_can_be_created_beside_one_of_a_limited_control():
    servo = "<position name='q' joint='f1' kp='5' ctrlrange='-{0} {0}'/>"
    without = robot(motors=servo.format(1))
    ends = (
        without,
        robot(motors=servo.format(2) + "<pid name='p' joint='f2' kp='9' ki='3' kv='.7'/>"),
    )
    evolve = rvl.Evolution(*ends)
    alone = [mujoco.MjModel.from_xml_string(text) for text in ends]
    assert alone[1].nu > len(alone[1].actuator_trntype)
    assert apart(alone[0], evolve.model(0), 200, ground=True).max() < 1e-4
    np.testing.assert_allclose(shaken(evolve.model(1)), shaken(alone[1]), atol=1e-9)
    np.testing.assert_allclose(evolve.model(0.5).actuator("q").ctrlrange, [-1.5, 1.5])


def mesh(corner, more=""):
    return (
        f"<mujoco><asset><mesh name='m' vertex='0 0 0 .1 0 0 0 .1 0 0 0 .1 {corner}'"
        " face='0 2 1 0 1 3 0 3 2 1 4 3 1 2 4 2 3 4'/></asset><worldbody><body name='b'>"
        f"<joint name='h'/><geom name='g' type='mesh' mesh='m' {more}/></body></worldbody></mujoco>"
    )


def test_a_mesh_whose_hull_loses_a_corner_is_refused_unless_nothing_collides_with_it():
    corners = ".1 .1 .1", ".02 .02 .02"
    with pytest.raises(ParameterError, match=r"convex hulls have \(5, 6\) and \(4, 4\) corners"):
        rvl.Evolution(*map(mesh, corners))
    free = rvl.Evolution(*(mesh(c, "contype='0' conaffinity='0'") for c in corners))
    masses = [free.model(alpha).body_mass[1] for alpha in (0.0, 0.5, 1.0)]
    assert masses[0] > masses[1] > masses[2] > 0


def test_a_quick_joint_can_be_created_in_a_robot_of_a_slow_and_explicit_clock():
    clock = "timestep='.01' integrator='RK4'"
    quick = robot(joint="stiffness='50'").replace("damping='.1'", "damping='2'")
    slow = robot(finger=False).replace("timestep='.002'", clock)
    evolve = rvl.Evolution(slow, quick, switch=0.5)
    alone = mujoco.MjModel.from_xml_string(slow)
    assert apart(alone, evolve.model(0), 100, ground=True).max() < 1e-6
    for alpha in np.linspace(0, 1, 11):
        shaken(evolve.model(alpha))


def test_a_group_that_disables_an_actuator_is_told_or_switched():
    off = "<option actuatorgroupdisable='1'/>"
    motors = ("<motor name='m' joint='f1' group='0'/>", "<motor name='m' joint='f1' group='1'/>")
    texts = [robot(head=off, motors=motor) for motor in motors]
    with pytest.raises(ParameterError, match="actuator/m/group: 0 -> 1"):
        rvl.Evolution(*texts)
    evolve = rvl.Evolution(*texts, switch=0.5)
    ends = [shaken(mujoco.MjModel.from_xml_string(text)) for text in texts]
    assert np.abs(ends[0] - ends[1]).max() > 0.01
    for alpha, end in ((0, 0), (0.4, 0), (0.5, 1), (1, 1)):
        np.testing.assert_allclose(shaken(evolve.model(alpha)), ends[end], atol=1e-9)
    rvl.Evolution(*(robot(motors=motor) for motor in motors))


@pytest.mark.parametrize("groups", [(0, 3), (3, 0)])
def test_a_group_that_an_inertia_is_not_inferred_from_weighs_nothing_at_its_end(groups):
    counted = "<compiler inertiagrouprange='0 1'/>"
    texts = [robot(head=counted, tip=ball(f"group='{group}'")) for group in groups]
    evolve = rvl.Evolution(*texts)
    masses = [mujoco.MjModel.from_xml_string(text).body("f2").mass[0] for text in texts]
    assert masses[0] != masses[1]
    for alpha in (0.0, 0.5, 1.0):
        expected = (1 - alpha) * masses[0] + alpha * masses[1]
        assert evolve.model(alpha).body("f2").mass[0] == pytest.approx(expected)
    for alpha, text in enumerate(texts):
        alone = shaken(mujoco.MjModel.from_xml_string(text))
        np.testing.assert_allclose(shaken(evolve.model(alpha)), alone, atol=1e-9)


SHAPES = {
    "sphere": "<geom name='h' size='.1' pos='.3 0 0' {}/>",
    "mesh": "<geom name='h' type='mesh' mesh='m' pos='.2 0 -.1' {}/>",
}


def table(shape, more):
    return (
        "<mujoco><asset><mesh name='m' vertex='0 0 0 .2 0 0 0 .2 0 0 0 .2 .2 .2 .2'/></asset>"
        "<worldbody><geom name='floor' type='plane' size='3 3 1'/><body name='b' pos='0 0 .2'>"
        "<joint name='j' axis='0 1 0' damping='.2'/><geom name='g' size='.1'/>"
        f"{SHAPES[shape].format(more)}</body><body name='o' pos='.3 0 .7'><joint name='o'"
        " type='slide' axis='0 0 1'/><geom name='o' size='.1' contype='2' conaffinity='3'/>"
        "</body></worldbody></mujoco>"
    )


@pytest.mark.parametrize("more", ["contype='0' conaffinity='0'", "contype='2' conaffinity='2'"])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("back", [False, True])
def test_a_geom_may_collide_from_an_alpha_on_or_up_to_one(shape, more, back):
    texts = [table(shape, more), table(shape, "")][:: -1 if back else 1]
    evolve = rvl.Evolution(*texts, switch=0.5)
    ends = [shaken(mujoco.MjModel.from_xml_string(text)) for text in texts]
    assert np.abs(ends[0] - ends[1]).max() > 0.01
    for alpha, expected in ((0, 0), (0.4, 0), (0.5, 1), (1, 1)):
        np.testing.assert_allclose(shaken(evolve.model(alpha)), ends[expected], atol=1e-9)


# What MjSpec knows besides theta: names and what belongs to whom, other ways to write what theta
# has, what only a compiler or a viewer looks at, and plugins, which are refused elsewhere.
LEFT = {
    "": "alt classname compiler frame group id info name parent plugin signature userdata",
    "body": "bodies cameras childclass explicitinertial frames fullinertia fuse geoms ialt joints "
    "lights simple sites",
    "geom": "fitscale hfieldname material meshname",
    "site": "material meshname",
    "camera": "intrinsic ipd mode output targetbody",
    "light": "active ambient attenuation bulbradius castshadow cutoff diffuse exponent intensity "
    "mode range softness specular targetbody texture type",
    "tendon": "material path",
    "actuator": "refsite slidersite target type",
    "equality": "name1 name2 objtype",
    "pair": "geomname1 geomname2",
    "sensor": "objname objtype refname reftype type",
    "mesh": "content_type file material needsdf octree_maxdepth refpos refquat "
    "smoothnormal userface userfacenormal userfacetexcoord usernode usernormal usertet "
    "usertexcoord",
    "hfield": "content_type file ncol nrow",
}


def _one_of_each():
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="b")
    made = {"body": body, "option": spec.option}
    for kind in ("geom", "joint", "site", "camera", "light"):
        made[kind] = getattr(body, f"add_{kind}")()
    for kind in ("tendon", "actuator", "equality", "pair", "sensor", "key", "mesh", "hfield"):
        made[kind] = getattr(spec, f"add_{kind}")()
    return made


def test_every_attribute_that_mujoco_knows_is_interpolated_compared_or_left_by_name():
    for kind, element in _one_of_each().items():
        known = {parameter.attribute for parameter in CONTINUOUS[kind]}
        known |= {*DISCRETE.get(kind, ()), *LEFT[""].split(), *LEFT.get(kind, "").split()}
        there = {a for a in dir(element) if not a.startswith("_")}
        there = {a for a in there if not callable(getattr(element, a))}
        assert there <= known, (kind, there - known)
