"""What `matching` and `trees` promise, against brute force and against robots from packages."""

import functools
import itertools

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.matching import match
from revolver_lab.evolution.nodes import Link, Node, Tree
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.trees import Matcher


def rooted_trees(size):
    """Every unlabelled rooted tree of so many bodies, as nested sorted tuples of children."""

    def forests(total, largest):
        if total == 0:
            yield ()
            return
        for first in range(min(total, largest), 0, -1):
            for tree in rooted_trees(first):
                for rest in forests(total - first, first):
                    yield tuple(sorted((tree, *rest)))

    return sorted(set(forests(size - 1, size - 1)))


def parents_of(shape):
    """The nested tuples as a list of parents, the root's being -1."""
    parents = []

    def add(node, parent):
        parents.append(parent)
        here = len(parents) - 1
        for child in node:
            add(child, here)

    add(shape, -1)
    return parents


def as_tree(parents, joints=None, *, free=False):
    """A robot with this tree under the world; one hinge above each body unless told otherwise."""
    joints = joints or [(Link(),) if p >= 0 or not free else () for p in parents]
    nodes = (Node(name="world"), *(Node(joints=tuple(links)) for links in joints))
    return Tree(nodes, (-1, *(p + 1 for p in parents)), frozenset({1}) if free else frozenset())


def most_common(children_a, root_a, children_b, root_b, worth):
    """Largest worth of a one-to-one map of two rooted trees: every assignment tried in turn."""
    total = worth(root_a, root_b)
    ours, theirs = children_a[root_a], children_b[root_b]
    swap = len(ours) > len(theirs)
    few, many = (theirs, ours) if swap else (ours, theirs)
    best = 0
    for chosen in itertools.permutations(many, len(few)):
        pairs = [(b, a) if swap else (a, b) for a, b in zip(few, chosen)]
        best = max(best, sum(most_common(children_a, a, children_b, b, worth) for a, b in pairs))
    return total + best


def children_from(parents, root=0):
    """Children lists of the tree re-rooted at a body."""
    near = {i: [] for i in range(len(parents))}
    for child, parent in enumerate(parents):
        if parent >= 0:
            near[child].append(parent)
            near[parent].append(child)
    children = {}

    def walk(body, above):
        children[body] = [b for b in near[body] if b != above]
        for b in children[body]:
            walk(b, body)

    walk(root, -1)
    return children


@functools.cache
def most_bodies(a, b):
    """Most bodies that two rooted trees share, both as nested tuples, by every assignment."""
    few, many = sorted((a, b), key=len)
    chosen = itertools.permutations(many, len(few))
    return 1 + max(sum(most_bodies(*sorted(p)) for p in zip(few, c)) for c in chosen)


def nested(parents, root):
    """The tree re-rooted at a body, as nested tuples."""
    children = children_from(parents, root)

    def shape(body):
        return tuple(sorted(shape(b) for b in children[body]))

    return shape(root)


SHAPES = [parents_of(shape) for size in range(1, 7) for shape in rooted_trees(size)]


def test_there_are_as_many_rooted_trees_as_mathematics_says():
    counts = [sum(len(shape) == n for shape in SHAPES) for n in range(1, 7)]
    assert counts == [1, 1, 2, 4, 9, 20]  # OEIS A000081


def test_fixed_robots_create_as_few_bodies_as_brute_force_on_every_pair_up_to_six_bodies():
    for a, b in itertools.product(SHAPES, repeat=2):
        kept = most_bodies(*sorted((nested(a, 0), nested(b, 0))))
        found = Matcher(as_tree(a), as_tree(b)).solve()
        # Each body comes with its joint, so each created node counts twice.
        assert found.created == 2 * (len(a) + len(b) - 2 * kept)


def test_floating_robots_create_as_few_bodies_as_brute_force_over_every_pair_of_roots():
    for a, b in itertools.combinations_with_replacement(SHAPES, 2):
        rooted = [{nested(shape, r) for r in range(len(shape))} for shape in (a, b)]
        kept = max(most_bodies(*sorted(pair)) for pair in itertools.product(*rooted))
        found = Matcher(as_tree(a, free=True), as_tree(b, free=True)).solve()
        assert found.created == 2 * (len(a) + len(b) - 2 * kept)


TYPES = st.lists(st.sampled_from(["hinge", "slide"]), max_size=3)


@st.composite
def labelled(draw):
    """A random tree of up to five bodies with up to three joints above each."""
    size = draw(st.integers(1, 5))
    parents = [-1, *(draw(st.integers(0, i)) for i in range(size - 1))]
    drives = st.sampled_from([(), ("joint",), ("joint", "parent")])
    joints = [tuple(Link(type=t, drives=draw(drives)) for t in draw(TYPES)) for _ in range(size)]
    return parents, joints


def in_order(a, b, chosen):
    """Whether chosen pairs cross only where the target's slides stand next to each other.

    A hinge between the source's slides does no harm: the padded robot keeps the source's order,
    and what the target lacks is held at zero.
    """
    for (_, j), (_, n) in itertools.combinations(sorted(chosen), 2):
        if j > n and any(link.type != "slide" for link in b[n : j + 1]):
            return False
    return True


def joint_worth(a, b):
    """Most that pairing joints in order saves, by trying all subsets."""
    pairs = [(i, j) for i in range(len(a)) for j in range(len(b)) if a[i].type == b[j].type]
    best = 0
    for count in range(1, min(len(a), len(b)) + 1):
        for chosen in itertools.combinations(pairs, count):
            one_to_one = len({i for i, _ in chosen}) == len({j for _, j in chosen}) == count
            if one_to_one and in_order(a, b, chosen):
                shared = sum(len(set(a[i].drives) & set(b[j].drives)) for i, j in chosen)
                best = max(best, 2 * count + 2 * shared)
    return best


@settings(max_examples=150, deadline=None)
@given(labelled(), labelled())
def test_joints_and_actuators_count_as_nodes_as_in_brute_force(a, b):
    def size(robot):
        return sum(1 + sum(1 + len(link.drives) for link in links) for links in robot[1])

    def worth(i, j):
        return 2 + joint_worth(a[1][i], b[1][j])

    saved = most_common(children_from(a[0]), 0, children_from(b[0]), 0, worth)
    found = Matcher(as_tree(*a), as_tree(*b)).solve()
    assert found.created == size(a) + size(b) - saved


@settings(max_examples=60, deadline=None)
@given(labelled(), labelled())
def test_a_correspondence_is_one_to_one_and_keeps_parents(a, b):
    trees = as_tree(*a), as_tree(*b)
    found = Matcher(*trees).solve()
    for side in (0, 1):
        bodies = [pair[side] for pair in found.bodies if pair[side] is not None]
        assert sorted(bodies) == list(range(len(trees[side].nodes)))
        joints = [pair[side] for pair in found.joints if pair[side] is not None]
        assert len(set(joints)) == len(joints) == sum(len(n.joints) for n in trees[side].nodes)
    twin = dict(found.bodies)
    for s, t in found.bodies[1:]:
        if s is not None and t is not None:
            assert twin[trees[0].parents[s]] == trees[1].parents[t]


def test_equal_names_settle_ties():
    names = ["torso", "a", "b", "c"]

    def robot(order):
        nodes = [Node(name="world"), Node(name="torso")]
        nodes += [Node(name=name, joints=(Link(name=name),)) for name in order]
        return Tree(tuple(nodes), (-1, 0, 1, 1, 1))

    for order in itertools.permutations(names[1:]):
        trees = robot(names[1:]), robot(order)
        for s, t in Matcher(*trees).solve().bodies:
            assert trees[0].nodes[s].name == trees[1].nodes[t].name


def test_a_source_root_is_kept_where_that_costs_nothing():
    chain = as_tree([-1, 0, 1], free=True)
    assert Matcher(chain, chain).solve().roots == ((1, 1),)
    middle = as_tree([-1, 0, 0], free=True)
    assert Matcher(chain, middle).solve().roots[0][0] == 1
    assert Matcher(chain, middle).solve().created == 0


def test_robots_of_forty_bodies_are_matched():
    rng = np.random.default_rng(0)
    trees = [
        as_tree([-1, *(int(rng.integers(0, i + 1)) for i in range(39))], free=True)
        for _ in range(2)
    ]
    found = Matcher(*trees).solve()
    assert 0 < found.created < 4 * 40


def arm(names, *, free=False, motors=True):
    """A chain of bodies as MJCF, each with one hinge and a motor."""
    text, driven = "", names[1:] if free else names
    for name in reversed(names):
        joint = "<freejoint name='free'/>" if free and name == names[0] else ""
        joint = joint or f"<joint name='{name}_hinge' axis='0 1 0'/>"
        text = f"<body name='{name}' pos='.3 0 0'>{joint}<geom size='.05'/>{text}</body>"
    motor = "".join(f"<motor name='{n}_motor' joint='{n}_hinge'/>" for n in driven)
    return f"<mujoco><worldbody>{text}</worldbody><actuator>{motor * motors}</actuator></mujoco>"


def matched(a, b, **options):
    """The matching of two robots given as XML."""
    return match(read_robot(a), read_robot(b), **options)


def test_a_longer_arm_creates_one_body_one_joint_and_one_motor():
    found = matched(arm(["a", "b"]), arm(["a", "b", "c"]))
    assert found.created == 3
    assert (None, "c") in found.bodies
    assert (None, "c_hinge") in found.joints
    assert (None, "c_motor") in found.actuators
    assert "+c" in str(found)
    assert found.target_levels == (("a", "world", 0), ("b", "a", 1), ("c", "b", 2))


def test_a_robot_without_motors_gets_them_created():
    assert matched(arm(["a", "b"]), arm(["a", "b"], motors=False)).created == 2


def test_pins_force_bodies_together():
    star = "<mujoco><worldbody><body name='t'><geom size='.1'/>{}{}</body></worldbody></mujoco>"
    leg = "<body name='{0}'><joint name='{0}'/><geom size='.1'/></body>"
    a = star.format(leg.format("left"), leg.format("right"))
    assert ("left", "left") in matched(a, a).bodies
    assert ("left", "right") in matched(a, a, pins={"left": "right"}).bodies
    assert ("right", "left") in matched(a, a, pins={"left": "right"}).joints


@pytest.mark.parametrize(
    ("pins", "message"),
    [
        ({"aa": "a"}, "no body or joint 'aa'.*such as a"),
        ({"a": "bb"}, "target has no body or joint 'bb'"),
        ({"a": "b", "b": "b"}, "share a partner"),
        ({"a": "b", "b": "a"}, "whose parents correspond"),
        ({"a": "b_hinge"}, "of a body and a joint"),
    ],
)
def test_impossible_pins_say_what_is_wrong(pins, message):
    with pytest.raises(MatchingError, match=message):
        matched(arm(["a", "b"]), arm(["a", "b"]), pins=pins)


def test_a_floating_and_a_welded_robot_are_refused():
    with pytest.raises(
        MatchingError, match=r"source floats and the target is welded .*\(floating: a\)"
    ):
        matched(arm(["a", "b"], free=True), arm(["a", "b"]))


def test_a_floating_robot_is_rerooted_where_that_creates_less():
    tail = arm(["a", "b", "c"], free=True)
    branch = "<body name='m{0}'><joint name='j{0}'/><geom size='.1'/></body>"
    middle = f"<freejoint name='free'/><geom size='.1'/>{branch.format(1)}{branch.format(2)}"
    middle = f"<mujoco><worldbody><body name='m'>{middle}</body></worldbody></mujoco>"
    found = matched(tail, middle)
    assert found.source_root == "a"
    assert found.target_root in ("m1", "m2")
    assert found.created == 2  # the two motors
    assert matched(tail, middle, root=("a", "m")).created > 2


def test_joints_of_one_body_correspond_in_order_but_slides_may_change_places():
    body = "<mujoco><worldbody><body name='t'>{}<geom size='.1'/></body></worldbody></mujoco>"
    x, z = "<joint name='x' type='slide' axis='1 0 0'/>", "<joint name='z' type='slide'/>"
    y = "<joint name='y' axis='0 1 0'/>"
    found = matched(body.format(x + z + y), body.format(z + x + y))
    assert set(found.joints) == {("x", "x"), ("z", "z"), ("y", "y")}
    assert matched(body.format(x + y), body.format(y + x)).created == 2


@pytest.mark.parametrize("pins", ["trunk", ["trunk"], 3, {"a": ["a"]}, {1: "a"}])
def test_pins_that_are_no_mapping_are_refused(pins):
    spec = read_robot("<mujoco><worldbody><body name='a'/></worldbody></mujoco>")
    with pytest.raises(MatchingError, match="a mapping"):
        match(spec, spec, pins=pins)


def test_the_drawing_says_what_becomes_of_the_scene():
    robot = "<mujoco><worldbody>{}<body name='a'><joint name='j'/><geom size='.1'/></body>"
    robot += "</worldbody></mujoco>"
    wall, ball = "<geom name='wall' type='box' size='1 1 1'/>", "<geom name='ball' size='.1'/>"
    found = matched(robot.format(wall), robot.format(ball))
    assert found.scenery == (("wall", None), (None, "ball"))
    assert str(found).splitlines() == [
        "source   target   (+ is created; 0 nodes in all)", "a        a",
        "= wall of the scene stays", "- ball of the target's scene is left out",
    ]  # fmt: skip
    assert matched(robot.format(wall), robot.format(wall)).scenery == ()


def test_joints_that_would_turn_into_each_other_are_created_instead_unless_they_are_pinned():
    body = "<mujoco><worldbody><body name='t'>{}<geom size='.1'/></body></worldbody></mujoco>"
    x, y = "<joint name='x' axis='1 0 0'/>", "<joint name='y' axis='0 1 0'/>"
    there, back = body.format(x + y), body.format(y + x)
    assert matched(there, back).created == 2
    assert set(matched(there, back, pins={"x": "y", "y": "x"}).joints) == {("x", "y"), ("y", "x")}
    renamed = body.format("<joint name='y' axis='1 0 0'/><joint name='x' axis='0 1 0'/>")
    assert matched(there, renamed).created == 0  # the same robot under other names


def test_a_plane_that_only_the_target_carries_is_said_to_be_left_out():
    robot = "<mujoco><worldbody><body name='a'><joint name='j'/><geom name='a' size='.1'/></body>"
    robot += "<body name='ship'>{}</body></worldbody></mujoco>"
    plane = "<geom name='deck' type='plane' size='1 1 1'/>"
    found = matched(robot.format(""), robot.format(plane))
    assert found.scenery == ((None, "deck"),)
    assert "deck" not in {name for pair in found.geoms for name in pair}
    assert str(found).splitlines()[-1] == "- deck of the target's scene is left out"
