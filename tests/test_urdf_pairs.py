"""Pairs of URDFs: links without mass, some only drawn, fixed ones that begin to turn."""

import mujoco
import numpy as np
import pytest
from test_pairs_of_many_parts import bursts, places

import revolver_lab as rvl
from revolver_lab.errors import ParameterError

SHAPES = ("<box size='.06 .05 .04'/>", "<sphere radius='.03'/>",
          "<cylinder radius='.02' length='.08'/>")  # fmt: skip
KEEP = "<mujoco><compiler discardvisual='false' fusestatic='false'/></mujoco>"
"""Reads links and visuals as they are written, as we do."""


def link(name, drawn=(), solid=(), mass=None):
    """A link with shapes that are drawn, shapes that touch, and its own mass or none."""
    kinds = (("visual", drawn), ("collision", solid))
    shapes = [f"<{tag}><geometry>{one}</geometry></{tag}>" for tag, some in kinds for one in some]
    inertia = "<inertia ixx='.02' iyy='.018' izz='.015' ixy='.001' ixz='0' iyz='0'/>"
    stated = f"<inertial><origin xyz='.02 0 -.05'/><mass value='{mass}'/>{inertia}</inertial>"
    return f"<link name='{name}'>{stated * (mass is not None)}{''.join(shapes)}</link>"


def joint(parent, child, kind, axis="0 1 0", place=".05 .02 -.3"):
    limit = "<limit lower='-1' upper='1' effort='9' velocity='2'/>"
    return (f"<joint name='{child}_joint' type='{kind}'><parent link='{parent}'/>"
            f"<child link='{child}'/><origin xyz='{place}' rpy='.1 .2 .3'/><axis xyz='{axis}'/>"
            f"{limit}</joint>")  # fmt: skip


def robot(*parts):
    return f"<robot name='r'>{KEEP}{''.join(parts)}</robot>"


def random_robot(rng, prefix):
    """A tree of two to six links; those that are welded to another may lack a mass."""
    count, parts = int(rng.integers(2, 7)), []
    for i in range(count):
        kind = "revolute" if i and rng.random() < 0.6 else "fixed"
        mass = rng.uniform(0.2, 2) if kind == "revolute" or rng.random() < 0.5 else None
        drawn, solid = (rng.choice(SHAPES, rng.integers(0, 3)) for _ in range(2))
        parts.append(link(f"{prefix}{i}", drawn, solid, mass))
        if i:
            place = " ".join(f"{x:.2f}" for x in [*rng.uniform(-0.3, 0.3, 2), -0.3])
            axis = str(rng.choice(["1 0 0", "0 1 0", "0 0 1"]))
            above = f"{prefix}{rng.integers(max(i - 2, 0), i)}"
            parts.append(joint(above, f"{prefix}{i}", kind, axis, place))
    return robot(*parts)


@pytest.mark.parametrize("seed", range(40))
def test_both_ends_move_as_mujoco_moves_the_robots_there(seed):
    rng = np.random.default_rng(seed)
    texts = [random_robot(rng, prefix) for prefix in "ab"]
    evolve = rvl.Evolution(*texts)
    for end, text in enumerate(texts):
        given = mujoco.MjModel.from_xml_string(text)
        names = [pair[end] for pair in evolve.matching.bodies if pair[end] is not None]
        ours = {pair[end]: pair[0] or pair[1] for pair in evolve.matching.bodies}
        found = evolve.model(float(end))
        np.testing.assert_allclose(places(found, [ours[name] for name in names]),
                                   places(given, names), atol=1e-3)  # fmt: skip
        assert found.body_mass.sum() == pytest.approx(given.body_mass.sum(), abs=1e-4)
    assert not bursts(evolve.model(0.5))


def test_what_is_drawn_becomes_what_is_drawn_and_the_rest_is_created():
    source = robot(link("base", SHAPES[:1], SHAPES[:1], 1.0))
    target = robot(link("base", (), [*SHAPES[:1], *SHAPES[:1]], 1.0))
    pairs = rvl.Evolution(source, target).matching.geoms
    # The source's first box is drawn, its second touches, and so do both of the target's.
    assert pairs == (("base_geom", None), ("base_geom2", "base_geom2"), (None, "base_geom"))
    assert rvl.Evolution(source, source).matching.geoms == (
        ("base_geom", "base_geom"), ("base_geom2", "base_geom2")
    )  # fmt: skip


def test_what_is_drawn_begins_to_touch_where_one_says_that_it_switches():
    source, target = (robot(link("base", mass=1.0, **{kind: SHAPES[:1]}))
                      for kind in ("drawn", "solid"))  # fmt: skip
    assert rvl.Evolution(source, target).matching.geoms == (
        ("base_geom", None),
        (None, "base_geom"),
    )
    switched = rvl.Evolution(source, target, switch=0.5)
    assert switched.matching.geoms == (("base_geom", "base_geom"),)
    assert [switched.model(alpha).geom_contype[0] for alpha in (0.4, 0.5)] == [0, 1]
    with pytest.raises(ParameterError, match="do not differ"):
        rvl.Evolution(source, source, switch={"geom/base_geom/contype": 0.5})


def test_shapes_grow_on_a_link_without_mass():
    bare, full = link("base", SHAPES[:2]), link("base", SHAPES[:2], SHAPES)
    evolve = rvl.Evolution(robot(bare), robot(full))
    volumes = 0.06 * 0.05 * 0.04, 4 / 3 * np.pi * 0.03**3, np.pi * 0.02**2 * 0.08
    for alpha in (0.0, 0.5, 1.0):  # mass goes on linearly: it is one of theta's coordinates
        assert evolve.model(alpha).body_mass[1] == pytest.approx(1000 * sum(volumes) * alpha)


def test_a_link_without_mass_turns_on_when_its_load_learns_to_turn_too():
    def three(mass, kind):
        links = link("base", mass=1.0), link("frame", mass=mass), link("load", (), SHAPES[:1], 0.7)
        return robot(*links, joint("base", "frame", "revolute"), joint("frame", "load", kind))

    with pytest.raises(ValueError, match="mjMINVAL"):
        mujoco.MjModel.from_xml_string(three(None, "revolute"))  # nothing carries the frame there
    ends, names = [three(None, "fixed"), three(0.1, "revolute")], ["base", "frame", "load"]
    evolve = rvl.Evolution(*ends)
    for alpha, text in enumerate(ends):
        expected = places(mujoco.MjModel.from_xml_string(text), names)
        np.testing.assert_allclose(places(evolve.model(alpha), names), expected, atol=1e-3)


@pytest.mark.parametrize("back", [False, True])
def test_a_robot_whose_pictures_cannot_be_read_is_matched_with_one_whose_can(tmp_path, back):
    solid = ["<box size='.1 .05 .04'/>"]
    unread = tmp_path / "unread.urdf"  # MuJoCo reads no .dae, so nothing of it is drawn
    parts = [link("base", ["<mesh filename='base.dae'/>"], solid),
             link("arm", ["<mesh filename='arm.dae'/>"], solid, 1),
             joint("base", "arm", "revolute")]  # fmt: skip
    unread.write_text(robot(*parts).replace(KEEP, ""))
    drawn = robot(link("base", ["<sphere radius='.08'/>"], solid),
                  link("arm", SHAPES, solid, 2), joint("base", "arm", "revolute"))  # fmt: skip
    robots = [drawn, unread] if back else [unread, drawn]
    evolve = rvl.Evolution(*robots)
    assert evolve.matching.created == 0
    counts = [mujoco.MjModel.from_xml_string(drawn).ngeom, evolve.model(0.5).ngeom]
    assert counts[0] == counts[1] > 4
