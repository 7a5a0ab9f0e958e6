"""What MuJoCo finds by itself, or leaves off, has no number beside it: a path must not jump."""

import mujoco
import numpy as np
import pytest
from test_uncommon_parts import OVER, robot, shaken, tendon

import revolver_lab as rvl
from revolver_lab.errors import ParameterError

LIMITS = "range='-60 60'"
WELD = "<equality><weld name='w' body1='f2' body2='base' {}/></equality>"
HIT = "<contact><pair name='p' geom1='f2' geom2='low' {}/></contact>"


def driven(motor):
    return robot(joint=LIMITS, motors=motor.format("name='m' joint='f1'"))


def sliding(more):
    """A finger that strikes the ground and slides over it."""
    low = "<geom name='low' type='plane' size='3 3 .1' pos='0 0 .97' contype='0'"
    low += " conaffinity='0'/>"
    return robot(scene=low, head="<option cone='elliptic'/>", rest=HIT.format(more))


DAMPED = "<position {} kp='50' dampratio='1'/>"
FOUND = {
    "the damping of a servo beside a motor": (driven("<motor {}/>"), driven(DAMPED)),
    "the damping of a servo beside a brake": (driven("<velocity {} kv='3'/>"), driven(DAMPED)),
    "the damping of a servo beside a stated one": (
        driven("<position {} kp='20' kv='2'/>"), driven(DAMPED)
    ),
    "the damping of a servo beside any law": (
        driven("<general {} gainprm='7 8 9' biasprm='4 5 -6'/>"), driven(DAMPED)
    ),
    "the rest of a tendon's spring": (
        robot(rest=tendon(OVER.format(""))),
        robot(rest=tendon(OVER.format(""), more="stiffness='20' springlength='.3'")),
    ),
    "how a weld holds": (
        robot(rest=WELD.format("")), robot(rest=WELD.format("relpose='-.3 0 0 -.9 0 .2 0'"))
    ),
    "the range of a servo": (
        driven("<position {} kp='5' inheritrange='1'/>"),
        driven("<position {} kp='5' ctrlrange='-.3 .7'/>"),
    ),
    "the range of a servo with memory": (
        driven("<intvelocity {} kp='5' inheritrange='.01'/>"),
        driven("<intvelocity {} kp='5' actrange='-.3 .01'/>"),
    ),
    "how stiff friction is": (sliding(""), sliding("solreffriction='.3 1'")),
}  # fmt: skip


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("name", FOUND)
def test_what_mujoco_finds_at_one_end_is_found_there_and_the_path_leads_to_it(name, back):
    texts = FOUND[name][:: -1 if back else 1]
    evolve = rvl.Evolution(*texts)
    ends = [shaken(mujoco.MjModel.from_xml_string(text)) for text in texts]
    assert np.abs(ends[0] - ends[1]).max() > 1e-4
    for alpha, end in ((0.0, 0), (1e-9, 0), (1 - 1e-9, 1), (1.0, 1)):
        np.testing.assert_allclose(shaken(evolve.model(alpha)), ends[end], atol=1e-6)


@pytest.mark.parametrize("alpha", [0.1, 0.5, 0.9, 0.999])
def test_no_damping_is_negative_between_a_motor_and_a_servo_told_by_its_ratio(alpha):
    model = rvl.Evolution(driven("<motor {}/>"), driven(DAMPED)).model(alpha)
    damped = mujoco.MjModel.from_xml_string(driven(DAMPED)).actuator("m").biasprm[2]
    assert model.actuator("m").biasprm[2] == pytest.approx(alpha * damped)


def test_two_ratios_of_damping_stay_ratios():
    servo = "<position {{}} kp='50' dampratio='{}'/>"
    evolve = rvl.Evolution(*(driven(servo.format(ratio)) for ratio in (1, 2)))
    alone = mujoco.MjModel.from_xml_string(driven(servo.format(1.5)))
    assert evolve.model(0.5).actuator("m").biasprm == pytest.approx(alone.actuator("m").biasprm)


def test_two_opposite_signs_of_how_a_weld_holds_are_one():
    texts = [
        robot(rest=WELD.format(f"relpose='-.3 0 0 {q}'")) for q in (".9 0 .2 0", "-.9 0 -.2 0")
    ]
    evolve = rvl.Evolution(*texts)
    alone = shaken(mujoco.MjModel.from_xml_string(texts[0]))
    for alpha in (0.0, 0.5, 1.0):
        np.testing.assert_allclose(shaken(evolve.model(alpha)), alone, atol=1e-9)


PID = "<pid {{}} kp='5' ki='20' kv='.5' {}/>"
OFF = {
    "posrange='-.2 .2'": "actuator/m/ctrllimited: false -> true",
    "velrange='-.2 .2'": "actuator/m/velrange",
    "imax='.001'": "actuator/m/dynprm",
}


@pytest.mark.parametrize("bound", OFF)
def test_a_bound_that_only_one_controller_has_is_told_or_switched(bound):
    texts = [driven(PID.format(more)) for more in ("", bound)]
    with pytest.raises(ParameterError, match=OFF[bound]):
        rvl.Evolution(*texts)
    evolve = rvl.Evolution(*texts, switch=0.5)
    ends = [shaken(mujoco.MjModel.from_xml_string(text)) for text in texts]
    assert np.abs(ends[0] - ends[1]).max() > 1e-4
    for alpha, end in ((0.0, 0), (0.49, 0), (1.0, 1)):
        np.testing.assert_allclose(shaken(evolve.model(alpha)), ends[end], atol=1e-9)


def test_a_controller_that_alone_limits_how_fast_its_setpoint_changes_is_refused_at_once():
    texts = [driven(PID.format(more)) for more in ("", "slewmax='3'")]
    with pytest.raises(ParameterError, match=r"'m' with 1 activations .* and 2 .* slewmax='1e9'"):
        rvl.Evolution(*texts)
    free = driven(PID.format("slewmax='1e9'"))
    ends = [shaken(mujoco.MjModel.from_xml_string(text)) for text in (texts[0], free)]
    np.testing.assert_allclose(*ends, atol=1e-12)
    rvl.Evolution(free, texts[1]).model(0.5)
