"""What decides between correspondences that create as much."""

import pytest

from revolver_lab.evolution.matching import match
from revolver_lab.evolution.reading import read_robot


def body(name, place="0 0 0", joints="", more=""):
    return f"<body name='{name}' pos='{place}' {more}>{joints}<geom size='.1'/></body>"


def matched(*texts, **options):
    robots = [f"<mujoco><worldbody>{text}</worldbody></mujoco>" for text in texts]
    return match(*map(read_robot, robots), **options)


def trunk(children):
    return f"<body name='trunk'><geom size='.1'/>{children}</body>"


@pytest.mark.parametrize("turn", [1, -1])
def test_of_two_equally_cheap_partners_the_one_at_the_like_place_is_taken(turn):
    ours = body("p", "0 .3 0") + body("q", "0 -.3 0")
    theirs = [body("r", "0 -.3 0"), body("s", "0 .3 0")]
    found = matched(trunk(ours), trunk("".join(theirs[::turn])))
    assert set(found.bodies) == {("trunk", "trunk"), ("p", "s"), ("q", "r")}


def test_of_two_partners_at_one_place_the_one_with_more_words_in_common_is_taken():
    ours = body("left_foot") + body("right_foot")
    theirs = body("foot_right_2") + body("foot_left_2")
    found = matched(trunk(ours), trunk(theirs))
    assert {("left_foot", "foot_left_2"), ("right_foot", "foot_right_2")} < set(found.bodies)


def test_of_two_partners_alike_in_all_else_those_that_come_in_order_are_taken():
    places = ["0 0 0"] * 4
    ours = "".join(map(body, "pqrs", places))
    found = matched(trunk(ours), trunk("".join(map(body, "tuvw", places))))
    assert set(found.bodies) == {("trunk", "trunk"), *zip("pqrs", "tuvw")}


@pytest.mark.parametrize(("axes", "partner"), [(("x", "y"), "u"), (("y", "x"), "v")])
def test_of_two_joints_the_one_about_the_like_axis_is_taken(axes, partner):
    along = {"x": "1 0 0", "y": "0 1 0"}
    pair = "".join(f"<joint name='{n}' axis='{along[a]}'/>" for n, a in zip("uv", axes))
    found = matched(body("a", joints="<joint name='h' axis='1 0 0'/>"), body("a", joints=pair))
    assert ("h", partner) in found.joints


def test_of_two_joints_about_one_axis_the_first_is_taken():
    pair = "".join(f"<joint name='{n}' axis='1 0 0' pos='0 0 .{k}'/>" for k, n in enumerate("uv"))
    found = matched(body("a", joints="<joint name='h' axis='1 0 0'/>"), body("a", joints=pair))
    assert ("h", "u") in found.joints


def test_what_hangs_on_a_mocap_body_is_not_made_of_what_does_not():
    found = matched(body("m", more="mocap='true'"), body("m"))
    assert set(found.bodies) == {("m", None), (None, "m")}
    assert found.created == 2


def glued(*names):
    glue = "".join(f"<adhesion name='{n}' body='{n[0]}' ctrlrange='0 1' gain='1'/>" for n in names)
    return f"<actuator>{glue}</actuator>"


def test_what_is_driven_becomes_what_is_driven_likewise_and_not_what_is_near():
    ours = trunk(body("p", "0 .3 0") + body("q", "0 -.3 0"))
    theirs = trunk(body("r", "0 .3 0") + body("s", "0 -.3 0"))
    texts = [f"<mujoco><worldbody>{tree}</worldbody>{motors}</mujoco>"
             for tree, motors in ((ours, glued("p")), (theirs, glued("s")))]  # fmt: skip
    found = match(*map(read_robot, texts))
    assert found.created == 0
    assert {("p", "s"), ("q", "r")} < set(found.bodies)


def test_a_body_is_kept_where_all_that_drives_it_has_to_be_created():
    site = "<body name='p'><geom size='.1'/><site name='x'/></body>"
    push = "".join(f"<motor name='m{k}' site='x' gear='1 0 0 0 0 0'/>" for k in range(2))
    texts = [
        f"<mujoco><worldbody>{trunk(site)}</worldbody><actuator>{push}</actuator></mujoco>",
        f"<mujoco><worldbody>{trunk(body('r'))}</worldbody>{glued('r1', 'r2')}</mujoco>",
    ]
    found = match(*map(read_robot, texts))
    assert ("p", "r") in found.bodies
    assert found.created == 4
