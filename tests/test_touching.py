"""Geoms touch at each end as in the robot that is there, whatever excludes, pairs or welds say."""

import mujoco
import numpy as np
import pytest
from test_uncommon_parts import robot, shaken

import revolver_lab as rvl
from revolver_lab.errors import ParameterError
from revolver_lab.evolution.touching import Touch, mixed

CHAIN = """<mujoco><option timestep="0.002"/><worldbody>
<geom name="floor" type="plane" size="2 2 .1" pos="0 0 -.3"/>
<body name="a"><joint name="j" axis="0 1 0" damping=".05"/><geom name="ga" size=".12"/>
<body name="b" pos=".3 0 0">{joint}<geom name="gb" size=".05" friction=".4 .02 .001"/>
<body name="c" pos="-.2 0 .08"><joint name="l" axis="0 1 0" damping=".05"/>
<geom name="gc" size=".11" solref=".01 1" friction=".7 .01 .002" margin="{margin}"/>
</body></body></body></worldbody><contact>{contact}</contact></mujoco>"""
JOINT = "<joint name='k' axis='0 1 0' damping='.05'/>"
EXCLUDED = "<exclude name='x' body1='a' body2='c'/>"
GROUND = "<exclude name='g' body1='world' body2='c'/>"
PAIR = ("<pair name='p' geom1='ga' geom2='gc' condim='3' friction='.2 .2 .01 .001 .001' "
        "solref='.05 1'/>")  # fmt: skip


def chain(contact="", joint=JOINT, margin=0):
    return CHAIN.format(contact=contact, joint=joint, margin=margin)


def end_poses(model, bodies, steps=400):
    """Where bodies are after a while; they fall, and roll over each other."""
    data = mujoco.MjData(model)
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return np.array([data.body(name).xpos for name in bodies])


ENDS = {
    "nothing": chain(),
    "excluded": chain(EXCLUDED),
    "grounded": chain(GROUND),
    "paired": chain(PAIR),
    "wide": chain(margin=0.01),
    "wide and excluded": chain(EXCLUDED, margin=0.01),
    "welded": chain(joint=""),
    "welded and excluded": chain(EXCLUDED, joint=""),
}


@pytest.mark.parametrize("target", ENDS)
@pytest.mark.parametrize("source", ENDS)
def test_both_ends_touch_as_the_robots_there_do(source, target):
    evolve = rvl.Evolution(ENDS[source], ENDS[target])
    for alpha, text in ((0.0, ENDS[source]), (1.0, ENDS[target])):
        alone = mujoco.MjModel.from_xml_string(text)
        apart = end_poses(evolve.model(alpha), "abc") - end_poses(alone, "abc")
        assert np.abs(apart).max() < 1e-6, alpha


def test_the_chains_differ_in_what_touches():
    poses = {name: end_poses(mujoco.MjModel.from_xml_string(text), "abc")
             for name, text in ENDS.items()}  # fmt: skip
    for name in ("excluded", "grounded", "paired", "welded"):
        assert np.abs(poses[name] - poses["nothing"]).max() > 1e-2, name


def test_between_the_ends_a_closing_pair_lets_in_as_much_as_is_left_of_the_way():
    ball = """<mujoco><worldbody><geom name="floor" type="plane" size="2 2 .1"/>
    <body name="ball" pos="0 0 .1"><joint name="z" type="slide" axis="0 0 1" damping="9"/>
    <geom name="ball" size=".1"/></body></worldbody><contact>{}</contact></mujoco>"""
    excluded = ball.format("<exclude name='x' body1='world' body2='ball'/>")
    evolve = rvl.Evolution(excluded, ball.format(""))
    for alpha in (0.9, 0.95, 0.99, 1.0):
        model = evolve.model(alpha)
        data = mujoco.MjData(model)
        for _ in range(5000):
            mujoco.mj_step(model, data)
        assert data.qpos[0] == pytest.approx(-10 * (1 - alpha), abs=0.01)


def test_a_pair_says_what_mujoco_would_have_found():
    rng = np.random.default_rng(0)
    for _ in range(60):
        geoms = "".join(
            f"<body name='{name}' pos='{x} 0 0'><freejoint/><geom name='{name}' size='.2' "
            f"condim='{rng.choice([1, 3, 4, 6])}' priority='{rng.integers(2)}' "
            f"solmix='{rng.choice([0, 0.5, 1, 3])}' friction='{rng.uniform(0.1, 2):.3f} .02 .003' "
            f"solref='{rng.choice(['.02 1', '.05 .7', '-900 -20'])}' "
            f"adhesion='{rng.choice([0, 2, 5])}' "
            f"solimp='{rng.uniform(0.5, 0.9):.3f} .95 .002' "
            f"margin='{rng.uniform(0, 0.05):.3f}' gap='{rng.uniform(0, 0.02):.3f}'/></body>"
            for name, x in (("a", 0), ("b", 0.3))
        )
        model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geoms}</worldbody></mujoco>")
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        contact, told = data.contact[0], mixed(model, "a", "b")
        assert contact.dim == told["condim"]
        assert np.allclose(contact.friction, told["friction"])
        assert np.allclose(contact.solref, told["solref"])
        assert np.allclose(contact.solimp, told["solimp"])
        assert np.isclose(contact.includemargin, told["margin"])
        assert np.isclose(contact.adhesion, told["adhesion"])


@pytest.mark.parametrize("back", [False, True])
def test_what_sticks_sticks_also_where_only_one_robot_excludes_the_two(back):
    glued = """<mujoco><option gravity="0 0 0"/><worldbody>
    <body name="a" pos="0 0 .1"><geom name="a" size=".1" adhesion="5"/></body>
    <body name="b" pos="0 0 .29"><joint name="z" type="slide" axis="0 0 1"/>
    <geom name="b" size=".1" adhesion="2"/></body></worldbody>{}</mujoco>"""
    texts = [glued.format(""), glued.format("<contact><exclude body1='a' body2='b'/></contact>")]
    evolve = rvl.Evolution(*texts[:: -1 if back else 1])
    for alpha, text in zip((1, 0) if back else (0, 1), texts):
        ends = []
        for model in (mujoco.MjModel.from_xml_string(text), evolve.model(alpha)):
            data = mujoco.MjData(model)
            data.qvel[0] = 0.1
            mujoco.mj_step(model, data, nstep=100)
            ends.append(data.qpos[0])
        assert ends[0] == pytest.approx(ends[1], abs=1e-9)


SHARED = "<option o_margin='.01'><flag override='enable'/></option>"
BALL = "<geom name='x' size='.02' pos='.2 0 -.9' {}/>"


@pytest.mark.parametrize(
    ("rest", "what"),
    [
        ("<exclude body1='f2' body2='world'/>", "'floor' and 'f2'"),
        ("<pair geom1='f1' geom2='base'/>", "'base' and 'f1'"),
    ],
)
def test_what_touches_in_one_robot_only_is_refused_where_contacts_share_a_margin(rest, what):
    made = [robot(head=SHARED, rest=f"<contact>{more}</contact>") for more in ("", rest)]
    for ends in (made, made[::-1]):
        with pytest.raises(ParameterError, match=rf"a contact of {what}.*override='enable'"):
            rvl.Evolution(*ends)


def test_what_would_be_created_is_refused_where_contacts_share_a_margin_unless_it_never_touches():
    plain, more = robot(head=SHARED), robot(head=SHARED, tip=BALL.format(""))
    for ends in ((plain, more), (more, plain)):
        with pytest.raises(ParameterError, match=r"geom 'x', which only one.*Take the flag away"):
            rvl.Evolution(*ends)
    drawn = robot(head=SHARED, tip=BALL.format("contype='0' conaffinity='0'"))
    alone = shaken(mujoco.MjModel.from_xml_string(plain))
    np.testing.assert_allclose(shaken(rvl.Evolution(plain, drawn).model(0)), alone, atol=1e-9)


def test_robots_that_touch_alike_get_no_pairs():
    for text in ENDS.values():
        alone = mujoco.MjModel.from_xml_string(text)
        assert rvl.Evolution(text, text.replace(".12", ".1")).model(0.0).npair == alone.npair


UNFILTERED = "<mujoco><option><flag filterparent='disable'/></option>"
TWO = """<mujoco><worldbody><body name='a'><freejoint/><geom name='a' size='.2' {}/></body>
<body name='b' pos='{} 0 0'><freejoint/><geom name='b' size='.2' {}/></body></worldbody>
<contact>{}</contact></mujoco>"""


def contacts(text):
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def test_masks_let_touch_what_mujoco_finds():
    rng, met = np.random.default_rng(0), []
    for _ in range(60):
        masks = [f"contype='{t}' conaffinity='{c}'" for t, c in rng.integers(0, 4, (2, 2))]
        text = TWO.format(masks[0], 0.3, masks[1], "")
        touch = Touch(mujoco.MjModel.from_xml_string(text))
        met.append(contacts(text).ncon > 0)
        assert touch("a", "b") == touch("b", "a") == met[-1]
    assert 10 < sum(met) < 50


def test_a_pair_begins_to_be_looked_at_where_its_geoms_would():
    sides = ["margin='.02' gap='.03'", "margin='.01' gap='.015'"]
    told = mixed(mujoco.MjModel.from_xml_string(TWO.format(sides[0], 0.3, sides[1], "")), "a", "b")
    pair = f"<pair geom1='a' geom2='b' margin='{told['margin']}' gap='{told['gap']}'/>"
    seen = []
    for apart in np.arange(0.3875, 0.5, 0.005):
        own = contacts(TWO.format(sides[0], apart, sides[1], ""))
        none = "contype='0' conaffinity='0'"
        ours = contacts(TWO.format(none, apart, none, pair))
        assert (own.ncon, own.nefc) == (ours.ncon, ours.nefc), apart
        seen.append((own.ncon, own.nefc > 0))
    assert set(seen) == {(1, True), (1, False), (0, False)}


@pytest.mark.parametrize("back", [False, True])
def test_nothing_touches_at_a_closed_end_however_much_larger_its_geoms_are(back):
    texts = [chain(), chain(EXCLUDED).replace('size=".12"', 'size=".4"')]
    texts = texts[::-1] if back else texts
    evolve = rvl.Evolution(*texts)
    for alpha, text in enumerate(texts):
        alone = mujoco.MjModel.from_xml_string(text)
        apart = end_poses(evolve.model(float(alpha)), "abc") - end_poses(alone, "abc")
        assert np.abs(apart).max() < 1e-6, alpha


@pytest.mark.parametrize("back", [False, True])
def test_parents_and_children_touch_where_they_are_not_filtered(back):
    excluded = "<exclude name='y' body1='a' body2='b'/>"
    grown = [chain(c).replace('size=".05"', 'size=".25"').replace("<mujoco>", UNFILTERED)
             for c in ("", excluded)]  # fmt: skip
    texts = grown[::-1] if back else grown
    evolve = rvl.Evolution(*texts)
    poses = []
    for alpha, text in enumerate(texts):
        poses.append(end_poses(mujoco.MjModel.from_xml_string(text), "abc"))
        apart = end_poses(evolve.model(float(alpha)), "abc") - poses[-1]
        assert np.abs(apart).max() < 1e-6, alpha
    assert np.abs(poses[0] - poses[1]).max() > 1e-2
