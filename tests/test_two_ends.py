"""What is written by its two ends has a frame besides, which some robots feel."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl

DOWN, UP = "0 0 0 0 0 -.2", "0 0 -.2 0 0 0"
ASLANT, BACK, NEARLY = "0 0 0 .1 .05 -.2", ".1 .05 -.2 0 0 0", "0 0 0 .02 0 -.2"
SITE = "<site name='s' type='capsule' size='.01' fromto='{}'/>"
GEOM = "<geom name='s' type='{}' size='.02' fromto='{}' {}/>"
THRUST = "<actuator><general name='u' site='s' gear='1 0 2 0 0 .1'/></actuator>"
FELT = "<sensor><accelerometer name='x' site='s'/><gyro name='y' site='s'/></sensor>"
AXES = "".join(f"<frame{axis}axis name='{axis}' objtype='geom' objname='s'/>" for axis in "xyz")
RELATIVE = "<framepos name='p' objtype='body' objname='o' reftype='geom' refname='s'/>"
BELT = "surfacevel='.5 0 1 0 0 0'"


def robot(ends, part, rest="<actuator/>"):
    return (
        "<mujoco><worldbody><geom name='floor' type='plane' size='3 3 .1'/>"
        "<body name='b' pos='0 0 .35'><joint name='z' type='slide' axis='0 0 1' damping='1'/>"
        "<joint name='x' type='slide' axis='1 0 0'/><joint name='j' axis='0 1 0' damping='.1'/>"
        f"<joint name='k' axis='1 0 0' damping='.1'/>{part.replace('@', ends)}"
        "<geom name='g' size='.05'/></body><body name='o' pos='.03 0 .03'><freejoint name='o'/>"
        f"<geom name='o' size='.03'/></body></worldbody>{rest}</mujoco>"
    )


PARTS = {
    "a site that pushes": (SITE.format("@"), THRUST),
    "a site that measures": (SITE.format("@"), FELT),
    "a geom whose axes are measured": (GEOM.format("capsule", "@", ""), f"<sensor>{AXES}</sensor>"),
    "a geom as a place to measure from": (
        GEOM.format("capsule", "@", ""), f"<sensor>{RELATIVE}</sensor>"
    ),
    "a belt": (GEOM.format("cylinder", "@", BELT), ""),
    "a box": (GEOM.format("box", "@", ""), ""),
}  # fmt: skip


def told(model, steps=150):
    """Where the robot goes and what it measures, (steps, nq + nsensordata)."""
    data, seen = mujoco.MjData(model), []
    data.qvel[:] = np.linspace(-0.5, 0.5, model.nv)
    for _ in range(steps):
        data.ctrl[:] = 1.0
        mujoco.mj_step(model, data)
        seen.append(np.concatenate([data.qpos, data.sensordata]))
    return np.array(seen)


@pytest.mark.parametrize("ends", [(DOWN, UP), (ASLANT, BACK), (DOWN, NEARLY), (UP, ASLANT)])
@pytest.mark.parametrize("name", PARTS)
def test_both_ends_feel_their_own_frame_and_the_path_leads_from_one_to_the_other(name, ends):
    texts = [robot(each, *PARTS[name]) for each in ends]
    evolve = rvl.Evolution(*texts)
    for alpha, text in enumerate(texts):
        alone = told(mujoco.MjModel.from_xml_string(text))
        np.testing.assert_allclose(told(evolve.model(alpha)), alone, atol=1e-9)
        near = told(evolve.model(abs(alpha - 1e-9)), 50)
        np.testing.assert_allclose(near, alone[:50], atol=1e-5)


def test_ends_of_a_rod_that_nothing_measures_stay_ends():
    texts = [robot(ends, GEOM.format("capsule", "@", "")) for ends in (DOWN, UP)]
    evolve = rvl.Evolution(*texts)
    assert "geom/s/fromto[0] [m]" in evolve.theta_names
    assert not evolve.theta_changed.any()
