"""Fits, terrains, hulls, lenses and sleep: both ends are the two robots, or it is refused."""

import mujoco
import numpy as np
import pytest
from test_sensors import felt
from test_uncommon_parts import robot, shaken

import revolver_lab as rvl
from revolver_lab.errors import ParameterError

CORNERS = "0 0 0 .1 0 0 0 .1 0 0 0 .1 .1 .2 .1"
FACES = "0 2 1 0 1 3 0 3 2 1 4 3 1 2 4 2 3 4"
MESH = f"<asset><mesh name='m' vertex='{CORNERS}' face='{FACES}' {{}}/></asset>"


def fitted(*, geom="type='box' mesh='m'", mesh="", compiler=""):
    """A robot whose last link is fitted to a mesh."""
    head = f"<compiler {compiler}/>" + MESH.format(mesh)
    return robot(head=head, tip=f"<geom name='x' pos='.2 0 0' euler='0 20 0' {geom}/>")


def thrower(mesh=""):
    """A robot that pushes at a site as far out as a mesh is large, and measures within it."""
    site = "<site name='x' type='mesh' mesh='m' pos='.2 0 0'/>"
    sensor = "<sensor><insidesite name='i' objtype='body' objname='f1' site='x'/></sensor>"
    return robot(head=MESH.format(mesh), tip=site, rest=sensor)


def landscape(size, heights, rows=2):
    """A robot of one ball on a terrain."""
    columns = len(heights.split()) // rows
    field = f"size='{size} .5 .1' nrow='{rows}' ncol='{columns}' elevation='{heights}'"
    return (
        f"<mujoco><asset><hfield name='h' {field}/></asset><worldbody><geom name='h' type='hfield'"
        " hfield='h'/><body name='b' pos='0 0 1'><freejoint name='r'/><geom name='g' size='.1'/>"
        "</body></worldbody></mujoco>"
    )


def sleeper(tolerance="1e-4", body=""):
    head = f"<option sleep_tolerance='{tolerance}'><flag sleep='enable'/></option>"
    crate = f"<body name='z' pos='1 0 .1' {body}><freejoint name='z'/><geom size='.1'/></body>"
    return robot(head=head, scene=crate)


SETTINGS = {
    "how large a fit is": [fitted(), fitted(geom="type='box' mesh='m' fitscale='1.5'")],
    "what a fit is to": [fitted(), fitted(compiler="fitaabb='true'")],
    "another fitted mesh": [fitted(), fitted(mesh="scale='1 2 1'")],
    "a fit and none": [fitted(), fitted(geom="type='box' size='.05 .04 .03'")],
    "a mesh that is a site": [thrower(), thrower("scale='2 2 2'")],
    "how large a terrain is": [landscape("2 2", "0 0 0 1"), landscape("1 3", "0 0 0 1")],
    "how high its points are": [landscape("1 1", "0 0 0 1"), landscape("1 1", "1 0 .5 0")],
    "when a robot sleeps": [sleeper("1e-4"), sleeper("1e-1")],
}


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("name", SETTINGS)
def test_both_ends_are_the_two_robots_and_what_is_between_moves(name, back):
    texts = SETTINGS[name][:: -1 if back else 1]
    evolve = rvl.Evolution(*texts)
    alone = [mujoco.MjModel.from_xml_string(text) for text in texts]
    for alpha, model in enumerate(alone):
        found = evolve.model(alpha)
        for field in ("geom_size", "geom_pos", "body_mass", "site_size", "hfield_size"):
            np.testing.assert_allclose(getattr(found, field), getattr(model, field), rtol=1e-9)
        np.testing.assert_array_equal(found.hfield_data, model.hfield_data)
        assert found.opt.sleep_tolerance == model.opt.sleep_tolerance
        np.testing.assert_allclose(shaken(found), shaken(model), atol=1e-9)
    assert evolve.theta_changed.any()
    shaken(evolve.model(0.5))


def test_a_fit_is_created_as_its_own_robot_has_it():
    with_it = fitted(compiler="fitaabb='true'", geom="type='box' mesh='m' fitscale='1.2'")
    evolve = rvl.Evolution(fitted(geom="type='sphere' size='.01'"), with_it)
    alone = mujoco.MjModel.from_xml_string(with_it)
    (created,) = {there or here for here, there in evolve.matching.geoms if not here}
    np.testing.assert_allclose(evolve.model(1).geom(created + "2").size, alone.geom("x").size)
    np.testing.assert_allclose(shaken(evolve.model(1)), shaken(alone), atol=1e-5)


def test_a_picture_of_a_terrain_moves_with_it():
    evolve = rvl.Evolution(*SETTINGS["how high its points are"])
    physics = evolve(0.0)
    before = physics.render(60, 80)
    evolve.set_alpha(physics, 1.0)
    np.testing.assert_array_equal(physics.render(60, 80), evolve(1.0).render(60, 80))
    assert (physics.render(60, 80) != before).any()


@pytest.mark.parametrize(
    ("one", "other", "told"),
    [
        (landscape("1 1", "0 0 0 1"), landscape("1 1", "0 0 0 1 1 1"), r"\(2, 2\).*\(2, 3\)"),
        (landscape("1 1", "0 0 0 1"), landscape("1 1", "0 0 0 0"), "all of one height"),
    ],
)
def test_terrains_between_which_there_is_none_are_refused(one, other, told):
    with pytest.raises(ParameterError, match=told):
        rvl.Evolution(one, other)


def sharp(more="", collides=""):
    """A robot with a round mesh, whose hull has many corners."""
    head = f"<asset><mesh name='m' builtin='sphere' params='2' scale='.1 .1 .1' {more}/></asset>"
    return robot(head=head, tip=f"<geom name='x' type='mesh' mesh='m' {collides}/>")


def test_a_hull_of_fewer_corners_is_refused_by_name_unless_it_is_the_same_hull():
    with pytest.raises(ParameterError, match="mesh/m/maxhullvert: -1 -> 8"):
        rvl.Evolution(sharp(), sharp("maxhullvert='8'"))
    for collides in ("", "contype='0' conaffinity='0'"):
        ends = sharp("", collides), sharp("maxhullvert='1000'", collides)
        alone = mujoco.MjModel.from_xml_string(ends[1])
        np.testing.assert_allclose(shaken(rvl.Evolution(*ends).model(1)), shaken(alone), atol=1e-9)


def test_whether_a_body_sleeps_is_refused_by_name_or_switches():
    ends = sleeper(), sleeper(body="sleep='never'")
    with pytest.raises(ParameterError, match="body/z/sleep: auto -> never"):
        rvl.Evolution(*ends)
    evolve = rvl.Evolution(*ends, switch=0.5)
    for alpha, end in ((0.0, ends[0]), (0.5, ends[1])):
        alone = mujoco.MjModel.from_xml_string(end)
        np.testing.assert_array_equal(
            evolve.model(alpha).tree_sleep_policy, alone.tree_sleep_policy
        )


def watched(lens, sensor=True):
    """A robot that a camera sees, and a sensor that tells where in its picture."""
    measured = "<sensor><camprojection name='p' site='s2' camera='c'/></sensor>"
    return robot(scene=f"<camera name='c' pos='0 -2 1' {lens}/>", rest=measured if sensor else "")


LENS = "resolution='200 100' focal='.01 .01' sensorsize='.02 .02'"


def test_the_lens_that_a_sensor_measures_through_is_refused_by_name_or_switches():
    ends = watched("xyaxes='1 0 0 0 0 1'"), watched("xyaxes='1 0 0 0 0 1' resolution='200 100'")
    with pytest.raises(ParameterError, match=r"camera/c/resolution: \[1, 1\] -> \[200, 100\]"):
        rvl.Evolution(*ends)
    evolve = rvl.Evolution(*ends, switch=0.5)
    for alpha, end in ((0.4, ends[0]), (0.5, ends[1])):
        alone = mujoco.MjModel.from_xml_string(end)
        np.testing.assert_array_equal(felt(evolve.model(alpha)), felt(alone))


def test_a_lens_that_is_only_looked_through_is_no_obstacle_and_stays():
    evolve = rvl.Evolution(watched("", False), watched(LENS, False))
    np.testing.assert_array_equal(evolve.model(1).cam_resolution, [[1, 1]])


def test_a_sensor_that_sees_through_a_camera_of_both_is_created():
    ends = watched("", False), watched("")
    evolve = rvl.Evolution(*ends)
    alone = mujoco.MjModel.from_xml_string(ends[1])
    np.testing.assert_array_equal(felt(evolve.model(1)), felt(alone))
