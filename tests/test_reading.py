"""Every robot file is read as MuJoCo reads it, or refused with what to do."""

import gymnasium
import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import ParameterError, RobotFileError
from revolver_lab.evolution.reading import read_robot

BOX = "<body name='b'><joint name='j'/><geom size='.1'/></body>"
BOMB = "<!DOCTYPE x [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;'>]><mujoco>&b;</mujoco>"
URDF = """<robot name="r"><link name="base">{}</link><link name="tip">
<inertial><mass value="{}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><box size=".1 .1 .1"/></geometry></visual></link><link name="flange"/>
<joint name="weld" type="fixed"><parent link="tip"/><child link="flange"/></joint>
<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="3" velocity="1"/></joint></robot>"""


def mjcf(inside="", before=""):
    return f"<mujoco>{before}<worldbody>{BOX}{inside}</worldbody></mujoco>"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "cannot be read|not a file"),
        ("<", "not well-formed"),
        ("<mujoco><worldbody>", "not well-formed"),
        ("<html></html>", "starts with <html>.*MJCF"),
        (
            "<robot name='r' xmlns:xacro='x'><xacro:property name='a' value='1'/></robot>",
            "uses <xacro:property>.*xacro robot.xacro > robot.urdf",
        ),
        ("<mujoco><nonsense/></mujoco>", "MuJoCo says.*Schema violation"),
        (BOMB, "DOCTYPE"),
        ("<mujoco>" + "<a>" * 500 + "</a>" * 500 + "</mujoco>", "nested 129 deep"),
        (mjcf("<geom size='.1' name='g'/><geom size='.1' name='g'/>"), "repeated name 'g'"),
        (mjcf("<body><geom size='.1'/></body>"), "a child of body 'world' without a name.*number"),
        (mjcf("<body name='c'><joint/><geom size='.1'/></body>"), "a joint of body 'c'"),
        (mjcf("<body name='c' pos='nan 0 0'/>"), "pos=.*finite"),
        (mjcf("<body name='c' pos='1e999 0 0'/>"), "pos=.*finite"),
        (mjcf("<body name='c'><joint name='k'/></body>"), "mjMINVAL.*geom with a mass"),
        (mjcf(before="<include file='/etc/passwd'/>"), "names the file '/etc/passwd'"),
        (mjcf(before="<extension><plugin plugin='p'/></extension>"), "<extension>"),
        (mjcf("<replicate count='9999999'><geom size='.1'/></replicate>"), "replicated"),
        (mjcf(before="<size memory='900G'/>"), "memory"),
        (mjcf(before="<asset><texture name='t' builtin='flat' width='99999'/></asset>"), "width"),
    ],
)
def test_bad_text_is_refused_with_what_is_wrong(text, message):
    with pytest.raises(RobotFileError, match=message) as caught:
        read_robot(text)
    assert caught.value.remedy
    assert caught.value.allowed


@pytest.mark.parametrize(
    "text",
    [
        mjcf("<body name='c'><joint name='k'/><geom size='.1' mass='-1'/></body>"),
        mjcf("<geom size='.1' density='-5'/>"),
        URDF.format("", "-1"),
    ],
)
def test_negative_mass_is_refused(text):
    with pytest.raises(ParameterError, match=r"mass|density"):
        read_robot(text)


def test_an_mjspec_with_negative_mass_is_refused():
    spec = mujoco.MjSpec.from_string(mjcf())
    spec.geoms[0].mass = -1
    with pytest.raises(ParameterError, match="mass -1"):
        read_robot(spec)


def test_a_path_that_does_not_exist_names_what_is_there(tmp_path):
    (tmp_path / "robot.xml").write_text(mjcf())
    with pytest.raises(RobotFileError, match=r"is not a file.*robot\.xml"):
        read_robot(str(tmp_path / "robto.xml"))
    with pytest.raises(RobotFileError, match="a int"):
        read_robot(3)  # type: ignore[arg-type]


@pytest.mark.parametrize("data", [b"", b"\0\1\2\xff" * 100, b"<mujoco>\xff\xfe</mujoco>"])
def test_binary_and_empty_files_are_refused(tmp_path, data):
    path = tmp_path / "robot.xml"
    path.write_bytes(data)
    with pytest.raises(RobotFileError):
        read_robot(path)


@pytest.mark.parametrize(
    "before",
    [
        "<asset><mesh name='m' file='../secret.stl'/></asset>",
        "<asset><mesh name='m' file='/etc/hosts'/></asset>",
        "<compiler meshdir='..'/>",
        "<compiler texturedir='/etc'/>",
        "<asset><texture name='t' type='2d' file='link.png'/></asset>",
        "<asset><hfield name='h' file='../h.png' size='1 1 1 1'/></asset>",
        "<include file='../other.xml'/>",
        "<include file='sub/more.xml'/>",
    ],
)
def test_files_outside_the_folder_are_refused(tmp_path, before):
    home = tmp_path / "robot"
    (home / "sub").mkdir(parents=True)
    (tmp_path / "other.xml").write_text("<mujoco/>")
    (home / "link.png").symlink_to("/etc/hosts")
    (home / "sub" / "more.xml").write_text(
        "<mujocoinclude><asset><mesh name='m' file='../../x.stl'/></asset></mujocoinclude>"
    )
    path = home / "robot.xml"
    path.write_text(mjcf(before=before))
    with pytest.raises(RobotFileError, match="outside its folder"):
        read_robot(path)


def test_a_missing_mesh_is_named(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(mjcf(before="<asset><mesh name='m' file='gone.stl'/></asset>"))
    with pytest.raises(RobotFileError, match=r"gone\.stl.*Put the file"):
        read_robot(path)


def test_includes_in_the_folder_are_followed(tmp_path):
    (tmp_path / "robot.xml").write_text(mjcf(before="<include file='more.xml'/>"))
    (tmp_path / "more.xml").write_text("<mujoco><option timestep='.004'/></mujoco>")
    assert read_robot(tmp_path / "robot.xml").option.timestep == 0.004


def test_everything_gets_a_name_and_the_given_spec_keeps_its_own():
    spec = mujoco.MjSpec.from_string(mjcf("<body><freejoint/><geom size='.1'/></body>"))
    named = read_robot(spec, unnamed="number")
    groups = (named.bodies, named.joints, named.geoms, named.sites, named.actuators)
    assert all(element.name for group in groups for element in group)
    assert "" in [geom.name for geom in spec.geoms]


def test_a_urdf_keeps_its_links_visuals_and_limits():
    spec = read_robot(URDF.format("", "1"))
    assert [body.name for body in spec.bodies[1:]] == ["base", "tip", "flange"]
    model = spec.compile()
    assert model.ngeom == 1
    np.testing.assert_allclose(model.joint("turn").range, [-1, 1])


@pytest.mark.parametrize("ixy", ["1", "-1"])
def test_an_inertia_that_no_body_has_is_left_out_where_nobody_feels_it(ixy):
    inertia = f"<mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='{ixy}' ixz='0' iyz='0'/>"
    base = f"<inertial>{inertia}</inertial>"
    assert read_robot(URDF.format(base, "1")).compile().nv == 1
    tip = URDF.format("", "1").replace('ixy="0"', f'ixy="{ixy}"')
    with pytest.raises(RobotFileError, match=r"positive eigenvalues.*three positive principal"):
        read_robot(tip)


def test_what_is_no_number_in_a_urdfs_inertia_is_refused():
    inertia = "<mass value='1'/><inertia ixx='a' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/>"
    with pytest.raises(RobotFileError):
        read_robot(URDF.format(f"<inertial>{inertia}</inertial>", "1"))


def test_package_paths_in_a_urdf_are_refused(tmp_path):
    mesh = '<visual><geometry><mesh filename="package://r/m.stl"/></geometry></visual>'
    path = tmp_path / "r.urdf"
    path.write_text(URDF.format(mesh, "1"))
    with pytest.raises(RobotFileError, match="package://"):
        read_robot(path)


@pytest.mark.parametrize("name", ["ant", "humanoid", "half_cheetah", "pusher"])
def test_reading_changes_no_array_of_the_compiled_robot(name):
    folder = gymnasium.__path__[0] + "/envs/mujoco/assets/"
    ours = read_robot(folder + f"{name}.xml", unnamed="number").compile()
    theirs = mujoco.MjModel.from_xml_path(folder + f"{name}.xml")
    for attribute in dir(theirs):
        value = getattr(theirs, attribute)
        if isinstance(value, np.ndarray) and not attribute.startswith(("name", "_")):
            np.testing.assert_array_equal(value, getattr(ours, attribute), attribute)


TINY = "v 0 0 0\nv 5e-6 0 0\nv 0 5e-6 0\nv 0 0 5e-6\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def ros_package(folder, mesh, manifest=None):
    """A package as ROS lays it out, with one URDF whose base is a mesh; returns the URDF."""
    for name in ("urdf", "meshes"):
        (folder / name).mkdir(parents=True)
    (folder / "meshes" / "base.obj").write_text(TETRAHEDRON)
    if manifest:
        (folder / "package.xml").write_text(f"<package><name>{manifest}</name></package>")
    base = f"<collision><geometry><mesh filename='{mesh}'/></geometry></collision>"
    (folder / "urdf" / "r.urdf").write_text(URDF.format(base, "1"))
    return folder / "urdf" / "r.urdf"


@pytest.mark.parametrize(
    ("folder", "mesh", "manifest"),
    [
        ("my_robot", "package://my_robot/meshes/base.obj", None),
        ("src", "package://my_robot/meshes/base.obj", "my_robot"),
        ("src", "../meshes/base.obj", "my_robot"),
        ("my_robot", "package://my_robot/meshes/base.obj", "renamed"),
        ("my_robot", "package:///my_robot/meshes/base.obj", None),
        ("many/robots/mine", "package://many/robots/mine/meshes/base.obj", None),
    ],
)
def test_the_meshes_of_a_ros_package_are_found(tmp_path, folder, mesh, manifest):
    spec = read_robot(ros_package(tmp_path / folder, mesh, manifest))
    model = spec.compile()
    assert model.nmesh == 1
    # A tetrahedron of three unit edges: a sixth of a cubic metre, of 1000 kg each.
    np.testing.assert_allclose(model.body("base").mass, 1000 / 6, rtol=1e-6)


@pytest.mark.parametrize(
    ("mesh", "manifest", "message"),
    [
        ("package://other/meshes/base.obj", None, "'other' around it or beside it"),
        ("package://", "my_robot", "a folder '' around it"),
        ("package://../secret.obj", None, "outside its folder"),
        ("package://my_robot/../secret.obj", None, "outside its folder"),
        ("../meshes/base.obj", None, "outside its folder"),
        ("../../secret.obj", "my_robot", "outside its folder"),
        ("/secret.obj", "my_robot", "outside its folder"),
        ("file:///secret.obj", "my_robot", "without any scheme"),
        ("package://", None, "a folder '' around it"),
    ],
)
def test_a_urdf_that_leaves_its_package_is_refused(tmp_path, mesh, manifest, message):
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    with pytest.raises(RobotFileError, match=message):
        read_robot(ros_package(tmp_path / "my_robot", mesh, manifest))


def test_a_folder_beside_a_urdf_may_be_called_a_package_and_the_text_begin_late(tmp_path):
    urdf = ros_package(tmp_path / "my_robot", "package://meshes/base.obj")
    late = tmp_path / "my_robot" / "late.urdf"
    late.write_text("\n\n <?xml version='1.0'?>" + urdf.read_text())
    assert read_robot(late).compile().nmesh == 1
    (tmp_path / "my_robot" / "linked").symlink_to(tmp_path)
    (tmp_path / "base.obj").write_text(TETRAHEDRON)
    late.write_text(urdf.read_text().replace("package://meshes", "package://linked"))
    with pytest.raises(RobotFileError, match="outside its folder"):
        read_robot(late)


@pytest.mark.parametrize(
    ("mesh", "text", "remedy"),
    [
        ("base.dae", "<COLLADA/>", r"Convert it: MuJoCo reads \.stl, \.obj and \.msh"),
        ("base.stl", "solid base\nfacet normal 0 0 1\nendsolid " + 80 * "x", "binary STL"),
        ("base.obj", TINY, "close the mesh"),
    ],
)
def test_of_a_mesh_that_mujoco_does_not_take_it_is_said_what_to_do(tmp_path, mesh, text, remedy):
    urdf = ros_package(tmp_path / "my_robot", f"package://my_robot/meshes/{mesh}")
    (tmp_path / "my_robot" / "meshes" / mesh).write_text(text)
    with pytest.raises(RobotFileError, match=remedy):
        read_robot(urdf)


def test_what_is_no_whole_robot_or_no_bodys_inertia_is_refused_with_what_to_do(tmp_path):
    part = tmp_path / "part.xml"
    part.write_text("<mujocoinclude><body name='b'/></mujocoinclude>")
    with pytest.raises(RobotFileError, match="give the file that includes it"):
        read_robot(part)
    with pytest.raises(RobotFileError, match="balanceinertia='true' in <compiler>"):
        read_robot(URDF.format("", "1").replace('izz="1"', 'izz="9"'))


def test_what_a_urdf_says_to_mujoco_stays_in_its_folder_too(tmp_path):
    urdf = ros_package(tmp_path / "my_robot", "package://my_robot/meshes/base.obj")
    asset = "<mujoco><asset><texture name='t' file='/etc/hostname'/></asset></mujoco></robot>"
    urdf.write_text(urdf.read_text().replace("</robot>", asset))
    with pytest.raises(RobotFileError, match="'/etc/hostname', outside its folder"):
        read_robot(urdf)


@pytest.mark.parametrize("compiler", ["meshdir='../meshes'", "meshdir='..' strippath='false'",
                                      "meshdir='../meshes' strippath='true'"])  # fmt: skip
def test_a_urdf_may_say_where_its_meshes_are_within_its_package(tmp_path, compiler):
    name = "meshes/base.obj" if "'..'" in compiler else "base.obj"
    name = "elsewhere/base.obj" if "'true'" in compiler else name
    urdf = ros_package(tmp_path / "src", name, "my_robot")
    settings = f"<mujoco><compiler {compiler}/></mujoco></robot>"
    urdf.write_text(urdf.read_text().replace("</robot>", settings))
    assert read_robot(urdf).compile().nmesh == 1
    (tmp_path / "src" / "package.xml").unlink()
    with pytest.raises(RobotFileError, match="outside its folder"):
        read_robot(urdf)


def test_the_two_robots_of_a_path_may_come_from_two_packages(tmp_path):
    one, other = (
        ros_package(tmp_path / name, f"package://{name}/meshes/base.obj") for name in ("a", "b")
    )
    mesh = other.parent.parent / "meshes" / "base.obj"
    mesh.write_text(TETRAHEDRON.replace("v 1 0 0", "v 2 0 0"))
    evolve = rvl.Evolution(one, other)
    masses = [evolve(alpha).model.ptr.body("base").mass[0] for alpha in (0, 0.5, 1)]
    np.testing.assert_allclose(masses, [1000 / 6, 1500 / 6, 2000 / 6], rtol=1e-6)
