"""A robot with another one attached to it is read as far as both may be, and evolves."""

import mujoco
import numpy as np
import pytest
from test_reading import TETRAHEDRON
from test_uncommon_parts import shaken

import revolver_lab as rvl
from revolver_lab.errors import RobotFileError
from revolver_lab.evolution.reading import read_robot

HAND = "<mujoco model='h'>{}<worldbody><body name='p'><geom size='.1'/></body></worldbody></mujoco>"
WITH_HAND = (
    "<mujoco>{}<worldbody><body name='b'><joint name='j'/><geom size='.1'/>"
    "<attach model='h' body='p' prefix='h_'/></body></worldbody></mujoco>"
)
MODEL = "<asset><model name='h' file='{}'/></asset>"


@pytest.mark.parametrize(
    ("hand", "told"),
    [
        ("<compiler meshdir='../..'/>", "'../..', outside"),
        ("<asset><mesh name='m' file='/etc/hosts'/></asset>", "'/etc/hosts', outside"),
        ("<include file='../../x.xml'/>", "'../../x.xml', outside"),
        (MODEL.format("../../x.xml"), "'../../x.xml', outside"),
        (MODEL.format("sub.xml"), "m.stl', outside"),
        (MODEL.format("link.xml"), "'../..', outside"),
        (MODEL.format("arm.urdf"), "'/etc/hosts', outside"),
        ("<asset><mesh name='m' file='../link/../../m.stl'/></asset>", "m.stl', outside"),
        (MODEL.format("hand.xml"), "at most 100 models, none of which attaches itself"),
    ],
)
@pytest.mark.parametrize("included", [False, True])
def test_the_files_of_an_attached_robot_stay_in_the_folder_too(tmp_path, hand, told, included):
    home = tmp_path / "robot"
    (home / "a" / "b").mkdir(parents=True)
    (home / "link").symlink_to(home / "a" / "b")
    (home / "a" / "b" / "deep.xml").write_text(HAND.format("<compiler meshdir='../..'/>"))
    (home / "a" / "link.xml").symlink_to(home / "a" / "b" / "deep.xml")
    (home / "a" / "sub.xml").write_text(HAND.format("<asset><mesh file='../../m.stl'/></asset>"))
    arm = "<robot><link><visual><geometry><mesh filename='/etc/hosts'/></geometry></visual></link>"
    (home / "a" / "arm.urdf").write_text(arm + "</robot>")
    (home / "a" / "hand.xml").write_text(HAND.format(hand))
    (home / "a" / "more.xml").write_text(f"<mujoco>{MODEL.format('hand.xml')}</mujoco>")
    start = "<include file='a/more.xml'/>" if included else MODEL.format("a/hand.xml")
    (home / "robot.xml").write_text(WITH_HAND.format(start))
    with pytest.raises(RobotFileError, match=told):
        read_robot(home / "robot.xml")


def test_an_attached_robot_reads_the_files_of_its_own_folder(tmp_path, monkeypatch):
    (tmp_path / "hand").mkdir()
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "p.obj").write_text(TETRAHEDRON)
    (tmp_path / "hand" / "more.xml").write_text("<mujoco><worldbody/></mujoco>")
    hand = "<include file='more.xml'/><compiler meshdir='../meshes'/>"
    hand = HAND.format(hand + "<asset><mesh name='p' file='p.obj'/></asset>")
    hand = hand.replace("size='.1'", "type='mesh' mesh='p'")
    (tmp_path / "hand" / "hand.xml").write_text(hand)
    (tmp_path / "more.xml").write_text(f"<mujoco>{MODEL.format('hand/hand.xml')}</mujoco>")
    (tmp_path / "robot.xml").write_text(WITH_HAND.format("<include file='more.xml'/>"))
    monkeypatch.chdir(tmp_path.parent)
    for path in (tmp_path / "robot.xml", f"{tmp_path.name}/robot.xml"):
        # A tetrahedron of three unit edges: a sixth of a cubic metre, of 1000 kg each.
        model = read_robot(path).compile()
        np.testing.assert_allclose(model.body("h_p").mass, 1000 / 6, rtol=1e-6)
    with pytest.raises(RobotFileError, match=r"names the file 'hand\.xml'.*stands alone"):
        read_robot(WITH_HAND.format(MODEL.format("hand.xml")))


@pytest.mark.parametrize("back", [False, True])
def test_an_attached_hand_is_created_from_the_files_of_its_own_folder(tmp_path, back):
    arm = (
        "<mujoco><compiler meshdir='meshes'/><asset><mesh name='p' file='p.obj'/>{}</asset>"
        "<worldbody><body name='b'><joint name='j' axis='0 1 0'/><geom type='mesh' mesh='p'/>{}"
        "</body></worldbody></mujoco>"
    )
    hand = (
        "<mujoco model='h'><compiler meshdir='meshes'/><asset><mesh name='p' file='q.obj'/></asset>"
        "<worldbody><body name='p' pos='0 0 1'><joint name='k'/><geom type='mesh' mesh='p'/></body>"
        "</worldbody></mujoco>"
    )
    for folder, name, edge in ((tmp_path, "p", "1"), (tmp_path / "hand", "q", "2")):
        (folder / "meshes").mkdir(parents=True)
        (folder / "meshes" / f"{name}.obj").write_text(TETRAHEDRON.replace("v 1", f"v {edge}"))
    (tmp_path / "hand" / "hand.xml").write_text(hand)
    attach = "<attach model='h' body='p' prefix='h_'/>"
    ends = [tmp_path / "arm.xml", tmp_path / "both.xml"]
    ends[0].write_text(arm.format("", ""))
    ends[1].write_text(arm.format("<model name='h' file='hand/hand.xml'/>", attach))
    evolve = rvl.Evolution(*(ends[::-1] if back else ends))
    assert evolve.matching.created == 2
    alone = mujoco.MjModel.from_xml_path(str(ends[1]))
    model = evolve.model(0 if back else 1)
    assert alone.body("h_p").mass > 1.9 * alone.body("b").mass
    np.testing.assert_allclose(model.body_mass, alone.body_mass, rtol=1e-6)
    np.testing.assert_allclose(shaken(model), shaken(alone), atol=1e-5)
    shaken(evolve.model(0.5))
