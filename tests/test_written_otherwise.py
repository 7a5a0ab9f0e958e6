"""A robot means the same however its file is written, and what has no meaning here is refused."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import MatchingError, ParameterError, RobotFileError
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.rerooting import reroot

PLAIN = """<mujoco><compiler angle="radian"/><worldbody>
  <light name="lamp" pos="1 2 3" dir="0 -1 0"/>
  <body name="trunk" pos="0 0 1" quat="0.7071067811865476 0 0 0.7071067811865476">
    <joint name="yaw" axis="0 1 0" range="-1 1" ref="0.1"/>
    <geom name="bone" type="capsule" size=".05" fromto="0 1 0  0 2 0"/>
    <site name="tip" pos="0 2 0"/>
    <camera name="eye" pos="0 -3 0" mode="targetbody" target="leaf"/>
    <body name="leaf" pos="0 2 0" quat="0 1 0 0">
      <joint name="bend" axis="0 0 -1"/>
      <geom name="blade" size=".1 .2 .3" type="box"/>
    </body>
  </body>
</worldbody></mujoco>"""

# The same: degrees, frames in frames, Euler angles, a class of defaults.
FRAMED = """<mujoco><compiler angle="degree"/>
<default><default class="bone"><geom type="capsule" size=".05"/></default></default>
<worldbody>
  <frame pos="1 0 3" euler="0 0 180"><light name="lamp" pos="0 -2 0" dir="0 1 0"/></frame>
  <frame pos="0 0 1" euler="0 0 90">
  <body name="trunk">
    <frame pos="0 1 0"><frame axisangle="0 0 1 90">
      <joint name="yaw" pos="-1 0 0" axis="1 0 0" range="-57.29577951308232 57.29577951308232"
             ref="5.729577951308232"/>
      <geom name="bone" class="bone" fromto="0 0 0  1 0 0"/>
      <site name="tip" pos="1 0 0" euler="0 0 -90"/>
      <camera name="eye" pos="-4 0 0" euler="0 0 -90" mode="targetbody" target="leaf"/>
    </frame></frame>
    <body name="leaf" pos="0 2 0" euler="180 0 0">
      <joint name="bend" axis="0 0 -1"/>
      <geom name="blade" size=".1 .2 .3" type="box"/>
    </body>
  </body></frame>
</worldbody></mujoco>"""

OTHER = """<mujoco><compiler angle="radian"/><worldbody>
  <body name="trunk" pos="0 0 2"><joint name="yaw" axis="0 0 1" range="-1 2"/>
    <geom name="bone" type="capsule" size=".1" fromto="0 0 0  0 0 1"/>
    <body name="leaf" pos="0 0 1"><joint name="bend" axis="1 0 0"/>
      <geom name="blade" size=".3 .2 .1" type="box" euler=".1 .2 .3"/>
    </body>
  </body>
</worldbody></mujoco>"""


def motion(model):
    """Where everything is, and how fast, over a tenth of a second from a bent pose, (50, ...)."""
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0 + np.linspace(0.2, 0.7, model.nq)
    seen = []
    for _ in range(50):
        mujoco.mj_step(model, data)
        places = [data.xipos, data.geom_xpos, data.site_xpos, data.cam_xpos, data.cam_xmat,
                  data.light_xpos, data.light_xdir, data.qpos, data.qvel]  # fmt: skip
        seen.append(np.concatenate([place.ravel() for place in places]))
    return np.array(seen)


def assert_same_robot(one, other):
    """Two robots are the same if they move alike."""
    np.testing.assert_allclose(motion(one), motion(other), atol=1e-9)


def test_frames_degrees_and_defaults_are_another_way_to_write_the_same_robot():
    assert_same_robot(*(mujoco.MjModel.from_xml_string(text) for text in (PLAIN, FRAMED)))


@pytest.mark.parametrize("alpha", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("way", ["from it", "to it"])
def test_a_path_does_not_see_how_its_robots_are_written(alpha, way):
    one, other = (
        rvl.Evolution(*((text, OTHER) if way == "from it" else (OTHER, text)))(alpha)
        for text in (PLAIN, FRAMED)
    )
    assert_same_robot(one.model.ptr, other.model.ptr)


def test_a_camera_that_only_the_source_has_still_looks_at_its_body_on_the_target():
    model = rvl.Evolution(PLAIN, OTHER)(1.0).model.ptr
    (body,) = model.camera("eye").targetbodyid
    assert model.body(body).name == "leaf"


BALL = "<body name='ball'><freejoint name='float'/><geom name='g{n}' size='.1'/>{inside}</body>"


def world(inside, around=""):
    return f"<mujoco><worldbody>{inside}</worldbody>{around}</mujoco>"


def arm(joint="", more=""):
    inside = f"<body name='arm' pos='.3 0 0'>{joint}<geom name='h' size='.1'/>{more}</body>"
    return BALL.format(n="", inside=inside)


HINGE = "<joint name='elbow' axis='0 1 0'/>"


def test_a_floating_body_without_a_partner_is_refused():
    two = BALL.format(n="", inside="") + BALL.format(n="2", inside="").replace("'ball'", "'spare'"
                                              ).replace("'float'", "'float2'")  # fmt: skip
    with pytest.raises(MatchingError, match=r"floating body '(spare|ball)' without a partner"):
        rvl.Evolution(world(two), world(BALL.format(n="", inside="")))


def test_a_robot_of_more_bodies_than_can_be_searched_is_refused():
    many = "".join(f"<body name='b{i}'><geom name='g{i}' size='.1'/></body>" for i in range(401))
    with pytest.raises(MatchingError, match=r"a robot of .* bodies, .* deep. Allowed: at most 400"):
        rvl.Evolution(world(many), world(many))


@pytest.mark.parametrize("root", ["arme", ("arme", None), (None, "bal1")])
def test_a_root_that_is_no_body_is_refused_with_near_names(root):
    robot = world(arm(HINGE))
    with pytest.raises(MatchingError, match=r"root=.*such as (arm|ball)"):
        rvl.Evolution(robot, robot, root=root)


def test_two_joints_that_can_only_correspond_the_other_way_round_turn_the_robot_round():
    robot = world(arm("<joint name='roll' axis='1 0 0'/><joint name='pitch' axis='0 1 0'/>"))
    usual = rvl.Evolution(robot, robot)
    crossed = rvl.Evolution(robot, robot, pins={"roll": "pitch"})
    assert dict(usual.matching.joints)["roll"] == "roll"
    assert dict(crossed.matching.bodies) == {"ball": "arm", "arm": "ball"}
    assert dict(crossed.matching.joints)["roll"] == "pitch"


def test_a_driven_ball_joint_cannot_be_turned_round():
    driven = world(arm("<joint name='hip' type='ball'/>"),
                   "<actuator><motor name='push' joint='hip'/></actuator>")  # fmt: skip
    with pytest.raises(MatchingError, match=r"'push' on the ball joint 'hip'.*three hinges"):
        reroot(read_robot(driven), "arm")


@pytest.mark.filterwarnings("ignore:Inertia matrix")  # a ball and a hinge turn the same body
def test_a_ball_before_another_joint_of_its_body_cannot_be_turned_round():
    shared = world(arm("<joint name='turn'/><joint name='hip' type='ball'/>",
                       "<body name='hand'><geom name='i' size='.1'/></body>"))  # fmt: skip
    with pytest.raises(MatchingError, match=r"root 'arm', with which MuJoCo says"):
        reroot(read_robot(shared), "arm")


def test_a_robot_rerooted_where_it_is_rooted_is_the_same():
    spec = read_robot(world(arm(HINGE)))
    assert_same_robot(spec.compile(), reroot(spec, "ball").compile())


def test_a_subtree_sensor_of_the_whole_robot_follows_its_root():
    sensor = (
        "<sensor><subtreecom name='all' body='ball'/><subtreecom name='part' body='arm'/></sensor>"
    )
    turned = reroot(read_robot(world(arm(HINGE), sensor)), "arm")
    assert {one.name: one.objname for one in turned.sensors} == {"all": "arm", "part": "arm"}


@pytest.mark.parametrize(
    "objects", ["subtree1='ball'", "subtree2='ball' geom1='floor'", "subtree1='ball' body2='world'"]
)
def test_a_contact_sensor_of_the_whole_robot_follows_its_root(objects):
    sensor = f"<sensor><contact name='all' {objects} num='9' data='found force'/></sensor>"
    floor = "<geom name='floor' type='plane' size='2 2 1' pos='0 0 -.15'/>"
    given = read_robot(world(floor + arm(HINGE), sensor))
    feels = []
    for model in (given.compile(), reroot(given, "arm").compile()):
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, nstep=300)
        feels.append(data.sensordata[0])
    assert feels[0] == feels[1] > 1


ALIGNED = """<mujoco><compiler alignfree='{align}'/><worldbody><body name='b' pos='0 0 1'>
<freejoint name='f'/><geom name='g' size='.1' pos='{x} 0 0'/>
<geom name='k' type='box' size='.1 .2 .3' pos='0 .5 {x}'/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("ends", [("true", "true"), ("true", "false"), ("false", "true")])
def test_a_free_body_is_aligned_to_its_inertia_where_its_own_file_says_so(ends):
    files = [ALIGNED.format(align=align, x=x) for align, x in zip(ends, (0.3, 0.6))]
    if ends[0] != ends[1]:
        with pytest.raises(ParameterError, match=r"joint/f/align.*switch=0.5"):
            rvl.Evolution(*files)
    evolve = rvl.Evolution(*files, switch=None if ends[0] == ends[1] else 0.5)
    for alpha, file in enumerate(files):
        assert_same_robot(evolve(alpha).model.ptr, mujoco.MjModel.from_xml_string(file))


def test_a_free_body_that_is_not_aligned_stays_so_where_a_part_is_created_on_it():
    plain = ALIGNED.format(align="false", x=0.3)
    more = plain.replace("/></body>", "/><geom name='n' size='.1'/></body>")
    evolve = rvl.Evolution(plain, more)
    assert_same_robot(evolve(1).model.ptr, mujoco.MjModel.from_xml_string(more))


def test_a_free_root_with_limbs_is_never_aligned_and_can_be_turned_round_on_one_side():
    plain = world(arm(HINGE))
    aligned = plain.replace("<freejoint name='float'/>", "<freejoint name='float' align='true'/>")
    for robot in (plain, aligned):
        evolve = rvl.Evolution(robot, plain, root=("ball", "arm"))
        assert_same_robot(evolve(0).model.ptr, mujoco.MjModel.from_xml_string(robot))


def test_a_flexible_body_of_a_specification_is_refused():
    soft = """<mujoco><worldbody><body name='b'><joint name='j'/><geom name='g' size='.1'/></body>
    <flexcomp name='cloth' type='grid' count='3 3 1' spacing='.1 .1 .1' mass='1' radius='.01'
    dim='2'/></worldbody></mujoco>"""
    with pytest.raises(RobotFileError, match=r"flex"):
        read_robot(mujoco.MjSpec.from_string(soft))


def test_unnamed_is_to_be_refused_or_numbered():
    with pytest.raises(RobotFileError, match=r'unnamed=.maybe..*"refuse" or "number"'):
        read_robot(PLAIN, unnamed="maybe")


def test_a_file_in_a_folder_that_cannot_be_listed_is_refused(tmp_path):
    with pytest.raises(RobotFileError, match=r"cannot be read"):
        read_robot(str(tmp_path / "nowhere" / "robot.xml"))


def test_a_path_of_more_than_four_gibibytes_of_memory_is_refused():
    with pytest.raises(RobotFileError, match=r"at most 4 GiB"):
        read_robot(PLAIN.replace("<compiler", "<size memory='5000000000'/><compiler"))


def test_files_that_include_each_other_are_read_once(tmp_path):
    (tmp_path / "robot.xml").write_text(
        "<mujoco><include file='a.xml'/><include file='b.xml'/><worldbody><body name='t'>"
        "<joint name='j'/><geom name='g' size='.1'/></body></worldbody></mujoco>")  # fmt: skip
    (tmp_path / "a.xml").write_text("<mujoco><option timestep='.004'/></mujoco>")
    (tmp_path / "b.xml").write_text("<mujoco><size nkey='1'/></mujoco>")
    assert read_robot(tmp_path / "robot.xml").compile().opt.timestep == 0.004


def test_an_included_file_that_is_itself_again_is_an_error_not_a_hang(tmp_path):
    (tmp_path / "robot.xml").write_text("<mujoco><include file='robot.xml'/></mujoco>")
    with pytest.raises(RobotFileError, match=r"MuJoCo says"):
        read_robot(tmp_path / "robot.xml")
