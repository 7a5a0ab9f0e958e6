"""What was attached to a robot infers its inertia as its own file says, at both ends of a path."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.rerooting import reroot

HAND = """<mujoco><compiler {}/><worldbody><body name="palm" pos="0 0 .1">
<geom name="palm" type="box" size=".02 .03 .04"/><geom name="mark" group="2" size=".03"/>
<body name="finger" pos="0 0 .1" euler="10 20 30"><joint name="f" axis="0 1 0" damping=".2"/>
<inertial mass="3" pos="0 0 .1" euler="20 30 40" diaginertia=".01 .02 .015"/>
<geom name="finger" type="capsule" size=".01" fromto="0 0 0 0 0 .1"/></body></body></worldbody>
<actuator><position name="f" joint="f" kp="3"/></actuator></mujoco>"""
ARM = """<mujoco><compiler {}/><worldbody><body name="one" pos="0 0 1">{}
<geom name="one" size=".1" pos=".1 0 0"/>
<body name="two" pos=".2 0 0"><joint name="k" axis="1 0 0" damping=".1"/>
<geom name="two" type="capsule" size=".02" fromto="0 0 0 0 0 .2"/>
<site name="mount" pos="0 0 .2"/></body></body></worldbody></mujoco>"""
HINGE = "<joint name='j' axis='0 1 0' damping='.1'/>"
BARE = ARM.format("", HINGE)
RULES = {
    "from geoms": "inertiafromgeom='true'",
    "of some groups": "inertiafromgeom='true' inertiagrouprange='0 1'",
    "of a least mass": "boundmass='5' boundinertia='.1'",
    "as stated": "",
}


def armed(hand, arm="", root=HINGE):
    spec = mujoco.MjSpec.from_string(ARM.format(arm, root))
    child = mujoco.MjSpec.from_string(HAND.format(hand))
    spec.attach(child, site=spec.site("mount"), prefix="h_")
    return spec


def swung(model, joints, steps=200):
    """Where these joints are, (joints,), after a push that all of them feel."""
    data = mujoco.MjData(model)
    data.qvel[:] = 0.3
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return np.array([data.joint(name).qpos[0] for name in joints])


@pytest.mark.parametrize("arm", ["", "inertiafromgeom='true'"])
@pytest.mark.parametrize("first", RULES)
@pytest.mark.parametrize("second", RULES)
def test_a_hand_is_as_heavy_at_each_end_as_its_own_file_says(first, second, arm):
    ends = [armed(RULES[rule], arm) for rule in (first, second)]
    evolve = rvl.Evolution(*ends)
    for alpha, end in enumerate(ends):
        alone = end.copy().compile()
        for field in ("mass", "inertia", "ipos"):
            expected = getattr(alone, f"body_{field}")
            np.testing.assert_allclose(getattr(evolve.model(alpha), f"body_{field}"), expected)


@pytest.mark.parametrize("rule", RULES)
def test_an_arm_that_has_no_hand_can_get_one_of_any_rule_and_lose_it(rule):
    hand = armed(RULES[rule])
    for ends in ((hand, BARE), (BARE, hand)):
        evolve = rvl.Evolution(*ends)
        for alpha, end in enumerate(ends):
            alone = (mujoco.MjSpec.from_string(end) if end is BARE else end.copy()).compile()
            names = [alone.joint(i).name for i in range(alone.njnt)]
            model = evolve.model(alpha)
            np.testing.assert_allclose(swung(model, names), swung(alone, names), atol=1e-6)
        for alpha in (0.1, 0.5, 0.9):
            assert np.isfinite(swung(evolve.model(alpha), ["j", "k"])).all()


@pytest.mark.parametrize("rule", RULES)
def test_a_robot_rooted_elsewhere_keeps_the_mass_of_what_was_attached(rule):
    floating = armed(RULES[rule], root="<freejoint name='r'/>")
    alone = floating.copy().compile()
    turned = reroot(read_robot(floating), "two").compile()
    for name in ("one", "two", "h_palm", "h_finger"):
        assert turned.body(name).mass == pytest.approx(alone.body(name).mass)
