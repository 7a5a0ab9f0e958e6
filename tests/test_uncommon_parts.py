"""Parts that few robots have come and go along a path: neither end feels it, nothing bursts."""

from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
import pytest
from test_padding import apart

import revolver_lab as rvl
from revolver_lab.evolution.reading import read_robot

STEPS = 200
FINGER = (
    "<body name='f1' pos='.1 0 0'><joint name='f1' axis='0 1 0' damping='.1' {joint}/>"
    "<geom name='f1' type='capsule' fromto='0 0 0 .2 0 0' size='.02'/>"
    "<site name='s1' pos='.1 0 .03'/>"
    "<body name='f2' pos='.2 0 0'><joint name='f2' axis='0 1 0' damping='.1'/>"
    "<geom name='f2' type='capsule' fromto='0 0 0 .2 0 0' size='.02'/>"
    "<site name='s2' pos='.1 0 .03'/>{tip}</body></body>"
)


def robot(*, finger=True, joint="", tip="", motors="", rest="", scene="", head=""):
    """A base on two hinges; with a finger of two links, and whatever hangs on it."""
    limb = FINGER.format(joint=joint, tip=tip) if finger else ""
    return (
        f"<mujoco>{head}<option timestep='.002'/><worldbody><geom name='floor' type='plane'"
        f" size='3 3 .1'/>{scene}<body name='base' pos='0 0 1'><joint name='turn' axis='0 0 1'"
        " damping='.5'/><joint name='tilt' axis='0 1 0' damping='.5' stiffness='5'/>"
        "<geom name='base' type='box' size='.1 .1 .05'/><site name='s0' pos='.05 0 .08'/>"
        f"{limb}</body></worldbody><actuator><motor name='turn' joint='turn'/>{motors}</actuator>"
        f"{rest}</mujoco>"
    )


def link(joint, *, inertial="<geom name='f3' size='.03'/>", more=""):
    """A third link."""
    return f"<body name='f3' pos='.2 0 0' {more}>{joint}{inertial}</body>"


def tendon(path, *, kind="spatial", more="stiffness='20'"):
    return f"<tendon><{kind} name='t' {more}>{path}</{kind}></tendon>"


OVER = "<site site='s1'/>{}<site site='s2'/>"
PARTS = {
    "a spatial tendon": robot(rest=tendon(OVER.format(""))),
    "a tendon around a cylinder": robot(
        tip="<geom name='w' type='cylinder' size='.015' fromto='0 -.03 0 0 .03 0' contype='0'"
        " conaffinity='0'/><site name='side' pos='0 0 .05'/>",
        rest=tendon(OVER.format("<geom geom='w' sidesite='side'/>"), more="range='0 .3'"),
    ),
    "a pulley": robot(
        rest=tendon("<site site='s0'/><site site='s1'/><pulley divisor='2'/>" + OVER.format("")),
        motors="<motor name='p' tendon='t'/>",
    ),
    "a muscle on a tendon": robot(
        rest=tendon("<site site='s0'/><site site='s2'/>", more=""),
        motors="<muscle name='m' tendon='t'/>",
    ),
    "a muscle on a joint": robot(joint="range='-60 60'", motors="<muscle name='m' joint='f1'/>"),
    "a muscle of a stated force": robot(
        joint="range='-60 60'", motors="<muscle name='m' joint='f1' force='30'/>"
    ),
    "a loop, by a body": robot(
        tip=link("<joint name='f3' axis='0 1 0'/>"),
        rest="<equality><connect name='c' body1='f3' body2='base' anchor='.01 0 0'/></equality>",
    ),
    "a loop, by two sites": robot(
        rest="<equality><weld name='c' site1='s2' site2='s0'/></equality>"
    ),
    "a loop, by two sites and stiffness": robot(
        rest="<equality><connect name='c' site1='s2' site2='s0' solref='-9 -1'/></equality>"
    ),
    "tendons made equal": robot(
        rest="<tendon><fixed name='t'><joint joint='f1' coef='1'/></fixed><fixed name='u'>"
        "<joint joint='f2' coef='1'/></fixed></tendon>"
        "<equality><tendon name='e' tendon1='t' tendon2='u'/></equality>"
    ),
    "a contact pair and an exclusion": robot(
        rest="<contact><pair name='p' geom1='f2' geom2='floor'/>"
        "<exclude name='x' body1='f2' body2='base'/></contact>"
    ),
    "a camera and a light that look at something": robot(
        tip="<camera name='c' pos='0 0 .1' mode='targetbody' target='base'/>"
        "<light name='l' pos='0 0 1' mode='targetbody' target='f1'/>"
    ),
    "a slider and crank": robot(
        motors="<general name='s' cranksite='s2' slidersite='s0' cranklength='.4'/>"
    ),
    "a thruster": robot(motors="<general name='s' site='s2' refsite='s0' gear='0 0 1 0 0 0'/>"),
    "adhesion": robot(motors="<adhesion name='a' body='f2' ctrlrange='0 1' gain='2'/>"),
    "servos with memory": robot(
        motors="<position name='p' joint='f1' kp='20' kv='1' ctrlrange='-1 1'/>"
        "<intvelocity name='v' joint='f2' kp='2' actrange='-1 1'/>"
        "<cylinder name='y' joint='f2' area='.01' timeconst='.1'/>"
    ),
    "sensors": robot(
        rest="<sensor><touch name='t' site='s2'/><subtreecom name='s' body='base'/>"
        "<framepos name='p' objtype='site' objname='s2' reftype='body' refname='base'/>"
        "<distance name='d' geom1='f2' geom2='floor' cutoff='1'/></sensor>"
    ),
    "a spring told by its frequency": robot(joint="springdamper='.1 1'"),
    "friction and armature": robot(joint="frictionloss='.3' armature='.01'"),
    "a ball joint": robot(tip=link("<joint name='f3' type='ball' damping='.01'/>")),
    "a slide": robot(tip=link("<joint name='f3' type='slide' axis='1 0 0' range='0 .1'/>")),
    "three joints on a body": robot(
        tip=link("<joint name='a' axis='0 1 0'/><joint name='b' axis='1 0 0'/>"
                 "<joint name='c' type='slide' axis='0 0 1' range='-.01 .01'/>")
    ),
    "a link that floats": robot(tip=link("<joint name='f3' axis='0 1 0'/>", more="gravcomp='1'")),
    "a link without a shape": robot(
        tip=link("<joint name='f3' axis='0 1 0'/>", inertial="<inertial pos='0 0 0' mass='.2'"
                 " diaginertia='1e-3 1e-3 1e-3'/>")
    ),
    "a place to be held at": robot(
        scene="<body name='m' mocap='true' pos='1 0 .5'><geom name='m' size='.05' contype='0'"
        " conaffinity='0'/></body>"
    ),
    "a link that a hand guides": robot(
        scene="<body name='m' mocap='true' pos='.5 0 1.3'><geom name='m' size='.05' contype='0'"
        " conaffinity='0'/></body>",
        rest="<equality><weld name='c' body1='m' body2='f2' solref='.02 1'/></equality>",
    ),
    "a frame without mass": robot(
        tip=link("", inertial="<inertial pos='.01 0 0' mass='0' diaginertia='0 0 0'/>"
                 "<site name='s3'/>")
    ),
    "a landscape": robot(
        scene="<geom name='h' type='hfield' hfield='h' pos='3 0 0'/>",
        head="<asset><hfield name='h' nrow='2' ncol='2' size='1 1 .1 .1' elevation='0 1 1 0'/>"
        "</asset>",
    ),
}  # fmt: skip
WITHOUT = robot(finger=False)


def shaken(model):
    """Where random controls bring a robot, (nq,); its warnings fail the test."""
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    for _ in range(STEPS):
        data.ctrl[:] = rng.uniform(-1, 1, model.nu)
        mujoco.mj_step(model, data)
    assert not any(warning.number for warning in data.warning)
    assert np.isfinite(data.qpos).all()
    return data.qpos.copy()


@pytest.fixture(scope="module", params=PARTS)
def evolve(request):
    return rvl.Evolution(WITHOUT, PARTS[request.param])


def test_the_robot_without_moves_as_before(evolve):
    alone = read_robot(WITHOUT).compile()
    assert apart(alone, evolve.model(0), STEPS, ground=True).max() < 1e-4


def test_the_robot_with_it_moves_as_before(evolve, request):
    text = PARTS[request.node.callspec.params["evolve"]]
    ends = [shaken(model) for model in (mujoco.MjModel.from_xml_string(text), evolve.model(1))]
    np.testing.assert_allclose(*ends, atol=1e-9)


def test_nothing_bursts_on_the_way(evolve):
    for alpha in np.linspace(0, 1, 11):
        shaken(evolve.model(alpha))


def test_the_way_back_is_the_same_way(evolve, request):
    there = PARTS[request.node.callspec.params["evolve"]]
    back = rvl.Evolution(there, WITHOUT)
    assert back.model(0).nq == evolve.model(1).nq
    alone = read_robot(WITHOUT).compile()
    assert apart(alone, back.model(1), STEPS, ground=True).max() < 1e-4


STILL = {
    "a mass and no inertia": "<inertial pos='0 0 0' mass='.01' diaginertia='0 0 0'/>",
    "neither": "<inertial pos='0 0 0' mass='0' diaginertia='0 0 0'/>",
    "no inertial": "<site name='s3'/>",
}


@pytest.mark.parametrize("still", STILL)
def test_what_stood_still_without_inertia_can_learn_to_turn(still):
    stiff = robot(tip=link("", inertial=STILL[still]))
    moving = robot(tip=link("<joint name='f3' axis='0 1 0' damping='.01'/>"))
    there = rvl.Evolution(stiff, moving)
    back = rvl.Evolution(moving, stiff)
    for evolve, alpha in ((there, 0.0), (back, 1.0)):
        alone = mujoco.MjModel.from_xml_string(stiff)
        assert apart(alone, evolve.model(alpha), STEPS, ground=True).max() < 1e-4
    shaken(there.model(0.5))


def test_many_created_points_need_no_memory_for_their_contacts():
    folders = (("gymnasium", "envs/mujoco/assets/humanoid.xml"),
               ("gymnasium_robotics", "envs/assets/fetch/push.xml"))  # fmt: skip
    files = [Path(find_spec(package).origin).parent / file for package, file in folders]
    ends = [mujoco.MjSpec.from_file(str(file)) for file in files]
    evolve = rvl.Evolution(*ends, unnamed="number", switch=0.5)
    assert evolve.matching.created > 50


def test_what_a_user_moves_becomes_nothing_else():
    guided = robot(scene="<body name='m' mocap='true' pos='1 0 .5'/>")
    for inside in ("", "<joint name='m'/><geom name='m' size='.1'/>"):
        body = f"<body name='m' pos='1 0 .5'>{inside}</body>"
        evolve = rvl.Evolution(guided, robot(scene=body))
        assert {pair for pair in evolve.matching.bodies if "m" in pair} == {("m", None),
                                                                           (None, "m")}  # fmt: skip
        assert evolve.model(0.0).nmocap == evolve.model(1.0).nmocap == 1


def test_a_skin_is_left_out_and_nothing_else_changes():
    path = Path(find_spec("dm_control").origin).parent / "suite" / "dog.xml"
    given = mujoco.MjModel.from_xml_path(str(path))
    ours = rvl.Evolution(path, path).model(0.0)
    assert (given.nskin, ours.nskin) == (1, 0)
    ends = [mujoco.MjData(model) for model in (given, ours)]
    for data in ends:
        mujoco.mj_step(data.model, data, nstep=50)
    np.testing.assert_array_equal(*(data.qpos for data in ends))
