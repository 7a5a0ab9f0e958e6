"""What an actuator does with its control: from any law to any other, exact at both ends."""

import itertools

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import ParameterError

LAWS = {
    "motor": "<motor {} ctrlrange='-1 1'/>",
    "servo": "<position {} kp='7' kv='.5' ctrlrange='-1 1'/>",
    "brake": "<damper {} kv='.2' ctrlrange='0 1'/>",
    "speed": "<velocity {} kv='2' ctrlrange='-1 1'/>",
    "spelt": "<general {} gainprm='7 8 9' biasprm='4 5 6' ctrlrange='-1 1'/>",
}
LAGS = {
    "at once": "<motor {} ctrllimited='false'/>",
    "filter": "<general {} gainprm='3' dyntype='filter' dynprm='.1' ctrllimited='false'/>",
    "exact": "<general {} gainprm='2' dyntype='filterexact' dynprm='.2' ctrllimited='false'/>",
    "early": "<general {} dyntype='filterexact' dynprm='.1' actearly='true'/>",
    "lagging servo": "<position {} kp='5' timeconst='.05' ctrllimited='false'/>",
    "integrator": "<intvelocity {} kp='5' actrange='-1 1' ctrllimited='false'/>",
    "muscle": "<muscle {} ctrllimited='false'/>",
}
NAMED = "name='m' joint='j'"
KEY = "<keyframe><key name='k' qpos='.1 .2' {}/></keyframe>"


def arm(law, more=""):
    """Two links; the first is driven by a law, the second by a motor."""
    return (
        "<mujoco><worldbody><body name='arm'><joint name='j' axis='0 1 0' range='-170 170'/>"
        "<geom name='g' size='.1' pos='.2 0 -.3'/><body name='hand' pos='.4 0 -.6'>"
        "<joint name='k' axis='0 1 0' damping='.1'/><geom name='h' size='.05' pos='.1 0 0'/></body>"
        f"</body></worldbody><actuator><motor name='n' joint='k'/>{law.format(NAMED)}"
        f"</actuator>{more}</mujoco>"
    )


def force(model, q=0.3, v=-0.4, u=0.6):
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0], data.ctrl = q, v, u
    mujoco.mj_forward(model, data)
    return data.qfrc_actuator[0]


def swung(model, steps=200):
    """Where the joints are under random controls, (steps, nq)."""
    rng, data, places = np.random.default_rng(0), mujoco.MjData(model), []
    for _ in range(steps):
        data.ctrl = rng.uniform(-1, 1, model.nu)
        mujoco.mj_step(model, data)
        places.append(data.qpos.copy())
    return np.array(places)


@pytest.mark.parametrize(("first", "second"), [*itertools.permutations(LAWS, 2)])
def test_a_motor_a_servo_and_a_brake_are_points_of_one_law(first, second):
    texts = [arm(LAWS[law]) for law in (first, second)]
    ends = [mujoco.MjModel.from_xml_string(text) for text in texts]
    evolve = rvl.Evolution(*texts)
    for alpha in (0.0, 0.25, 1.0):  # the law is linear in its parameters, and so in alpha
        expected = (1 - alpha) * force(ends[0]) + alpha * force(ends[1])
        assert force(evolve.model(alpha)) == pytest.approx(expected, abs=1e-12)
    for alpha, end in enumerate(ends):
        np.testing.assert_array_equal(swung(evolve.model(alpha)), swung(end))


@pytest.mark.parametrize(("first", "second"), [*itertools.permutations(LAGS, 2)])
def test_an_actuator_may_begin_to_lag_behind_its_control_and_both_ends_stay_exact(first, second):
    texts = [arm(LAGS[law]) for law in (first, second)]
    evolve = rvl.Evolution(*texts, switch=0.5)
    for alpha, text in enumerate(texts):
        expected = swung(mujoco.MjModel.from_xml_string(text))
        np.testing.assert_allclose(swung(evolve.model(alpha)), expected, rtol=0, atol=1e-14)
    for alpha in (0.1, 0.49, 0.5, 0.9):
        assert np.isfinite(swung(evolve.model(alpha))).all()


def test_between_a_motor_and_one_that_lags_early_the_lag_grows_and_nothing_has_to_switch():
    evolve = rvl.Evolution(arm(LAGS["at once"]), arm(LAGS["early"]))
    for alpha in (0.0, 0.25, 1.0):
        model = evolve.model(alpha)
        data = mujoco.MjData(model)
        data.ctrl[1] = 1.0
        mujoco.mj_step(model, data)
        expected = 1 - np.exp(-model.opt.timestep / max(0.1 * alpha, 1e-12))
        assert data.actuator_force[1] == pytest.approx(expected, rel=1e-7)


def test_what_a_number_means_switches_with_its_law():
    evolve = rvl.Evolution(arm(LAGS["filter"]), arm(LAGS["muscle"]), switch=0.5)
    for alpha, end in ((0.1, 0.0), (0.49, 0.0), (0.5, 1.0), (0.9, 1.0)):
        now, then = (evolve.model(at).actuator("m") for at in (alpha, end))
        for law in ("gainprm", "biasprm", "dynprm"):
            np.testing.assert_array_equal(getattr(now, law), getattr(then, law))


@pytest.mark.parametrize("lagging", [0, 1])
def test_a_keyframe_keeps_what_it_says_of_activations(lagging):
    lags = arm(LAGS["filter"], KEY.format("act='.3'"))
    texts = [arm(LAGS["at once"], KEY.format("")), lags]
    if not lagging:
        texts.reverse()
    evolve = rvl.Evolution(*texts, switch=0.5)
    np.testing.assert_array_equal(evolve.model(float(lagging)).key("k").act, [0.3])


def test_without_a_switch_the_dynamics_are_told_as_the_files_have_them():
    with pytest.raises(ParameterError, match="actuator/m/dyntype: none -> filter"):
        rvl.Evolution(arm(LAGS["at once"]), arm(LAGS["filter"]))


def test_flags_that_differ_are_told_by_name():
    flags = "<option><flag contact='disable' gravity='disable' energy='enable'/></option>"
    said = "disableflags: contact and gravity -> none; option/world/enableflags: energy -> none"
    with pytest.raises(ParameterError, match=said):
        rvl.Evolution(arm(LAWS["motor"], flags), arm(LAWS["motor"]))


@pytest.mark.parametrize("back", [False, True])
def test_an_activation_that_was_given_is_bounded_as_the_other_ones_all_the_way(back):
    texts = [arm(LAGS["at once"]), arm(LAGS["integrator"])]
    evolve = rvl.Evolution(*(texts[::-1] if back else texts), switch=0.5)
    for alpha in (0.0, 0.25, 0.5, 0.75, 1.0):
        assert evolve.model(alpha).actuator("m").actrange.tolist() == [-1, 1]


@pytest.mark.parametrize("stated", ["lengthrange='-1 2'", "lengthrange='-1 2' force='30'"])
def test_lengths_of_a_muscle_that_one_file_states_lie_between_those_of_both_robots(stated):
    muscle = "<muscle {} ctrllimited='false' %s/>"
    evolve = rvl.Evolution(arm(muscle % ""), arm(muscle % stated))
    ends = [evolve.model(alpha).actuator("m").lengthrange.copy() for alpha in (0.0, 1.0)]
    np.testing.assert_allclose(ends[0], np.deg2rad([-170, 170]), atol=0.02)  # of the joint
    np.testing.assert_allclose(ends[1], [-1, 2])
    found = evolve.model(0.25).actuator("m").lengthrange
    np.testing.assert_allclose(found, 0.75 * ends[0] + 0.25 * ends[1], atol=1e-9)
