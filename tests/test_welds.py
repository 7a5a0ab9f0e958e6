"""Links that are welded to each other: whichever carries which, the robot is the same."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import ParameterError
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.welds import is_chained, unchain

FLOOR = "<geom name='floor' type='plane' size='5 5 .1' condim='1'/>"


def random_chains(seed):
    """A tree of eight links, of which every other is welded; with what refers to them.

    Without friction: its pyramid stands as the two geoms of a contact come one after the other.
    """
    rng = np.random.default_rng(seed)
    above = [0, *(int(rng.integers(max(i - 3, 0), i)) for i in range(1, 8))]
    turns = [bool(rng.random() < 0.45) for _ in range(8)]
    turns[7] = True

    def body(i):
        joint = f"<joint name='j{i}' axis='{rng.choice(['1 0 0', '0 1 0'])}' damping='.2'/>"
        place = " ".join(f"{x:.2f}" for x in rng.uniform(-0.4, 0.4, 3) + 0.5 * (i == 0))
        turn = " ".join(f"{x:.1f}" for x in rng.uniform(-90, 90, 3))
        below = "".join(body(j) for j in range(1, 8) if above[j] == i)
        return (
            f"<body name='b{i}' pos='{place}' euler='{turn}'>{joint * turns[i]}"
            f"<geom name='g{i}' size='.06' pos='.1 .05 .02' condim='1'"
            f" mass='{rng.uniform(0.2, 2):.2f}'/>"
            f"<site name='s{i}' pos='.02 0 .03'/>{below}</body>"
        )

    keys = " ".join(["0.1"] * sum(turns))
    return (
        f"<mujoco><worldbody>{FLOOR}{body(0)}</worldbody>"
        "<tendon><spatial name='t' stiffness='30'><site site='s0'/><site site='s7'/></spatial>"
        "</tendon><actuator><motor name='m' joint='j7' gear='3'/></actuator>"
        "<contact><exclude body1='b0' body2='b7'/></contact>"
        "<sensor><framepos objtype='body' objname='b7' reftype='body' refname='b0'/></sensor>"
        f"<keyframe><key name='k' qpos='{keys}' ctrl='.4'/></keyframe></mujoco>"
    )


def told(model, steps=150):
    """Poses and sensors after so many steps from the keyframe, by name."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, nstep=steps)
    mujoco.mj_forward(model, data)
    bodies = sorted(model.body(i).name for i in range(model.nbody))
    poses = [np.concatenate([data.body(name).xpos, data.body(name).xmat]) for name in bodies]
    return np.concatenate([*poses, data.sensordata])


@pytest.mark.parametrize("seed", range(20))
def test_a_robot_whose_chains_are_undone_moves_as_before(seed):
    spec = read_robot(random_chains(seed))
    undone = unchain(spec)
    assert not is_chained(undone)
    np.testing.assert_allclose(told(undone.compile()), told(spec.compile()), atol=1e-9)


def test_there_are_chains_among_them_and_contacts_that_count():
    specs = [read_robot(random_chains(seed)) for seed in range(20)]
    assert sum(map(is_chained, specs)) > 10
    apart = 0
    for spec in specs:
        model = spec.compile()
        before = told(model)
        model.geom_contype[:] = 0
        apart += np.abs(told(model) - before).max() > 1e-3
    assert apart > 2


def quadruped(*, base="", trunk="trunk", leg=0.3):
    """Four legs on a trunk, which may be welded to a base; `{}` is where the trunk goes."""
    legs = "".join(
        f"<body name='{name}_hip' pos='{x} {y} 0'><joint name='{name}_hip' axis='1 0 0'/>"
        f"<geom name='{name}_hip' size='.04'/><body name='{name}_calf' pos='0 0 -{leg}'>"
        f"<joint name='{name}_calf' axis='0 1 0'/><geom name='{name}_calf' type='capsule'"
        f" fromto='0 0 0 0 0 -{leg}' size='.02'/></body></body>"
        for name, x, y in (("FL", 0.3, 0.2), ("FR", 0.3, -0.2), ("RL", -0.3, 0.2),
                           ("RR", -0.3, -0.2))
    )  # fmt: skip
    body = (f"<body name='{trunk}' pos='0 0 1'><geom name='{trunk}' type='box' size='.3 .1 .05'/>"
            f"{legs}</body>")  # fmt: skip
    motors = "".join(f"<motor name='{name}' joint='{name}_calf'/>" for name in ("FL", "RR"))
    return (f"<mujoco><worldbody>{base.format(body) if base else body}</worldbody>"
            f"<actuator>{motors}</actuator></mujoco>")  # fmt: skip


EMPTY = "<body name='base' pos='0 0 .2'>{}</body>"
TWICE = "<body name='base'><body name='mount' pos='.1 0 0' euler='0 0 30'>{}</body></body>"


@pytest.mark.parametrize("base", [EMPTY, TWICE])
@pytest.mark.parametrize("back", [False, True])
def test_a_trunk_on_a_base_corresponds_to_a_trunk_without_one(base, back):
    robots = [quadruped(), quadruped(base=base, trunk="body", leg=0.5)]
    robots = robots[::-1] if back else robots
    evolve = rvl.Evolution(*robots)
    pairs = {tuple(sorted(map(str, pair))) for pair in evolve.matching.bodies if None not in pair}
    assert ("body", "trunk") in pairs
    assert {("FL_hip", "FL_hip"), ("RR_calf", "RR_calf")} < pairs
    assert evolve.matching.created == base.count("<body")
    assert "links that are welded to each other hang from one" in str(evolve.matching)
    for alpha, text in enumerate(robots):
        given = mujoco.MjModel.from_xml_string(text)
        ends = [mujoco.MjData(model) for model in (given, evolve.model(alpha))]
        for data in ends:
            data.ctrl[:2] = 0.3
            mujoco.mj_step(data.model, data, nstep=100)
        for source, target in evolve.matching.bodies:
            if None not in (source, target):
                here = ends[0].body((source, target)[alpha]).xpos, ends[1].body(source).xpos
                np.testing.assert_allclose(*here, atol=1e-9)


def test_a_pin_of_two_trunks_is_kept_although_their_parents_differ():
    evolve = rvl.Evolution(quadruped(), quadruped(base=EMPTY, trunk="body"), pins={"trunk": "body"})
    assert ("trunk", "body") in evolve.matching.bodies


def test_chains_that_are_in_both_robots_stay_as_they_are():
    robots = [quadruped(base=EMPTY, leg=leg) for leg in (0.3, 0.5)]
    evolve = rvl.Evolution(*robots)
    assert evolve.matching.created == 0
    assert evolve.matching.source_levels[1] == ("trunk", "base", 1)
    assert "welded" not in str(evolve.matching)


@pytest.mark.parametrize(
    ("sensor", "stays"),
    [("subtreecom name='c' body='base'", True), ("contact name='c' subtree1='base'", True),
     ("contact name='c' body1='base'", False)],
)  # fmt: skip
def test_a_robot_that_senses_a_subtree_stays_as_it_is(sensor, stays):
    robot = quadruped(base=EMPTY)
    assert is_chained(read_robot(robot))
    sensing = robot.replace("</mujoco>", f"<sensor><{sensor}/></sensor></mujoco>")
    assert is_chained(read_robot(sensing)) != stays


def test_what_a_compiler_fuses_or_does_not_draw_is_neither_lost_nor_created():
    settings = "<mujoco><compiler fusestatic='true' discardvisual='true'/>"
    drawn = "<geom name='seen' size='.2' contype='0' conaffinity='0' mass='0'/>"
    hidden = quadruped(base="<body name='base'>" + drawn + "{}</body>").replace(
        "<mujoco>", settings
    )
    shown = quadruped(base=EMPTY.replace("{}", drawn + "{}"), leg=0.4)
    for robots in ((hidden, shown), (shown, hidden)):
        evolve = rvl.Evolution(*robots)
        found = mujoco.MjData(evolve.model(float(robots[1] is hidden)))
        given = mujoco.MjData(mujoco.MjModel.from_xml_string(hidden))
        for data in (found, given):
            mujoco.mj_step(data.model, data, nstep=100)
        here = given.body("FL_calf").xpos
        np.testing.assert_allclose(found.body("FL_calf").xpos, here, atol=1e-9)


def test_two_that_differ_in_what_cannot_change_are_refused_with_chains_or_without():
    limited = quadruped(base=EMPTY).replace("axis='1 0 0'", "axis='1 0 0' range='-1 1'")
    with pytest.raises(ParameterError, match="limited"):
        rvl.Evolution(quadruped(), limited)


LINK = "<body name='{0}' pos='.1 .2 0' quat='{1}'><geom name='{0}' size='.05'/>{2}</body>"


def test_a_link_on_a_mocap_body_stays_on_it():
    carried = LINK.format("a", "1 0 0 0", "")
    mocap = f"<body name='m' mocap='true'><geom size='.1'/>{carried}</body>"
    assert not is_chained(read_robot(f"<mujoco><worldbody>{mocap}</worldbody></mujoco>"))
    chain = LINK.format("b", "1 0 0 0", LINK.format("c", "1 0 0 0", ""))
    spec = read_robot(f"<mujoco><worldbody>{mocap}{chain}</worldbody></mujoco>")
    assert is_chained(spec)
    undone = unchain(spec)
    assert undone.body("a").parent.name == "m"
    assert undone.body("c").parent.name == "world"


def test_chains_are_undone_in_place_where_their_quaternions_are_not_of_length_one():
    turned = LINK.format(
        "b", "2 0 0 1", LINK.format("c", "0 3 1 0", LINK.format("d", "1 1 1 9", ""))
    )
    spec = read_robot(f"<mujoco><worldbody>{turned}</worldbody></mujoco>")
    found = []
    for robot in (spec, unchain(spec)):
        data = mujoco.MjData(robot.compile())
        mujoco.mj_kinematics(data.model, data)
        found.append([np.append(data.body(n).xpos, data.body(n).xmat) for n in "bcd"])
    np.testing.assert_allclose(*found, atol=1e-12)
