"""Whatever files two robots call by the same name, each keeps what is in its own."""

import matplotlib.image
import mujoco
import numpy as np
import pytest
from test_reading import TETRAHEDRON

import revolver_lab as rvl
from revolver_lab.errors import MatchingError
from revolver_lab.evolution.matching import match
from revolver_lab.evolution.padding import pad
from revolver_lab.evolution.reading import read_robot

LINK = (
    "<mujoco>{}<asset><mesh name='m' file='link.stl'/></asset><worldbody><body name='b'>"
    "<joint name='j' axis='0 1 0'/><geom name='g' type='mesh' mesh='m'/>{}</body></worldbody>"
    "</mujoco>"
)
MORE = (
    "<body name='c' pos='0 0 1'><joint name='k' axis='0 1 0'/>"
    "<geom name='h' type='mesh' mesh='m'/></body>"
)
MD = "<compiler meshdir='md'/>"


def solid(edge, faces=((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))):
    """A tetrahedron with three edges at right angles, or the faces named, as binary STL."""
    corners = np.array([[0, 0, 0], [edge, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype="<f4")
    triangles = ([*np.zeros(3, "<f4"), *corners[list(face)].ravel()] for face in faces)
    told = b"".join(np.array(t, "<f4").tobytes() + bytes(2) for t in triangles)
    return bytes(80) + len(faces).to_bytes(4, "little") + told


def in_memory(edge, inside, head="", key="link.stl", more=()):
    assets = {key: solid(edge, *more)}
    return mujoco.MjSpec.from_string(LINK.format(head, inside), assets=assets)


def on_disk(folder, edge, inside):
    folder.mkdir()
    (folder / "link.stl").write_bytes(solid(edge))
    (folder / "r.xml").write_text(LINK.format("", inside))
    return folder / "r.xml"


WAYS = {
    "both in memory": lambda _: (in_memory(1, ""), in_memory(3, MORE)),
    "a folder before one": lambda _: (in_memory(1, "", MD, "md/link.stl"), in_memory(3, MORE)),
    "a folder before both": lambda _: (
        in_memory(1, "", MD, "md/link.stl"), in_memory(3, MORE, MD, "md/link.stl")),
    "the second in memory": lambda folder: (on_disk(folder / "a", 1, ""), in_memory(3, MORE)),
    "the first in memory": lambda folder: (in_memory(1, ""), on_disk(folder / "a", 3, MORE)),
    "both on the disk": lambda folder: (
        on_disk(folder / "a", 1, ""), on_disk(folder / "b", 3, MORE)),
}  # fmt: skip


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_meshes_of_equal_file_names_stay_each_robots_own(tmp_path, way, back):
    ends = WAYS[way](tmp_path)
    evolve = rvl.Evolution(*ends[:: -1 if back else 1])
    # A tetrahedron of three edges: a sixth of their product, of 1000 kg per cubic metre.
    for alpha, masses in ((back, [1000 / 6, 0]), (not back, [3000 / 6, 3000 / 6])):
        found = evolve.model(float(alpha)).body_mass[1:]
        np.testing.assert_allclose(found, masses, rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("file", ["link.obj", "LINK.obj"])
def test_what_is_remembered_of_another_robots_file_is_not_taken(file):
    ends = [
        mujoco.MjSpec.from_string(
            LINK.format("", "").replace("link.stl", file),
            assets={"link.obj": TETRAHEDRON.replace("v 1 ", f"v {edge} ").encode()},
        )
        for edge in (1, 3)
    ]
    evolve = rvl.Evolution(*ends)
    masses = [float(evolve.model(alpha).body("b").mass[0]) for alpha in (0.0, 0.5, 1.0)]
    np.testing.assert_allclose(masses, [1000 / 6, 2000 / 6, 3000 / 6], rtol=1e-5)
    assert list(ends[0].assets) == ["link.obj"]


SIX = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4))


@pytest.mark.parametrize("back", [False, True])
def test_meshes_of_equal_file_names_and_other_faces_are_no_obstacle(back):
    ends = [in_memory(1, "", more=[SIX]), in_memory(3, MORE)][:: -1 if back else 1]
    evolve = rvl.Evolution(*ends)
    for alpha, end in enumerate(ends):
        alone = end.compile()
        np.testing.assert_allclose(evolve.model(alpha).body("b").mass, alone.body("b").mass)


@pytest.mark.parametrize("memory", [False, True])
@pytest.mark.parametrize("back", [False, True])
def test_a_texture_of_six_files_comes_along(tmp_path, back, memory):
    sides = ("right", "left", "up", "down", "front", "back")
    for i, side in enumerate(sides):
        picture = np.full((4, 4, 3), 40 * i, np.uint8)
        picture[0, 0] = 255
        matplotlib.image.imsave(tmp_path / f"{side}.png", picture)
    files = " ".join(f"file{side}='{side}.png'" for side in sides)
    ball = "<body name='c'><joint name='k'/><geom size='.1' material='m'/></body>"
    assets = f"<texture name='t' type='cube' {files}/><material name='m' texture='t'/>"
    robot = "<mujoco><asset>{}</asset><worldbody><body name='b'><joint name='j'/>{}</body>"
    robot += "</worldbody></mujoco>"
    ends = [robot.format("", "<geom size='.1'/>"), tmp_path / "b.xml"]
    text = robot.format(assets, "<geom size='.1'/>" + ball)
    ends[1].write_text(text)
    alone = mujoco.MjModel.from_xml_path(str(ends[1]))
    if memory:
        pictures = {f"{side}.png": (tmp_path / f"{side}.png").read_bytes() for side in sides}
        ends[1] = mujoco.MjSpec.from_string(text, assets=pictures)
    model = rvl.Evolution(*(ends[::-1] if back else ends)).model(0)
    np.testing.assert_array_equal(model.tex_data, alone.tex_data)
    assert model.tex("t").type == alone.tex("t").type


def test_a_file_that_is_gone_by_the_time_it_is_copied_is_named(tmp_path):
    ends = [
        read_robot(on_disk(tmp_path / side, 1, more)) for side, more in (("a", ""), ("b", MORE))
    ]
    matching = match(*ends)
    (tmp_path / "b" / "link.stl").unlink()
    with pytest.raises(MatchingError, match=r"MuJoCo says.*link\.stl"):
        pad(*ends, matching)
