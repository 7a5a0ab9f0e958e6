"""A joint that only one robot has, between bodies that the other has welded, lets go gradually."""

import mujoco
import numpy as np
import pytest

from revolver_lab.evolution.evolution import Evolution

ARM = """<mujoco><option timestep=".002" gravity="0 0 0"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0"/>
<geom name="upper" type="capsule" size=".04" fromto="0 0 0 .3 0 0"/>
<body name="lower" pos=".3 0 0">{wrist}
<geom name="lower" type="capsule" size=".04" fromto="0 0 0 .3 0 0"/></body></body></worldbody>
<actuator><motor name="shoulder" joint="shoulder" gear="2"/>{motor}</actuator></mujoco>"""
STIFF = ARM.format(wrist="", motor="")
WRIST = '<joint name="wrist" axis="0 1 0" damping=".1"/>'
BENDING = ARM.format(wrist=WRIST, motor='<motor name="wrist" joint="wrist"/>')


def bent(model, steps=200):
    """How far the wrist is bent after some steps with its motor on [rad]."""
    data = mujoco.MjData(model)
    data.actuator("wrist").ctrl = 1.0
    mujoco.mj_step(model, data, steps)
    return float(data.joint("wrist").qpos[0])


def test_it_lets_go_along_the_way_and_not_in_the_last_step():
    evolve = Evolution(STIFF, BENDING)
    found = np.array([bent(evolve.model(alpha)) for alpha in (0, 0.25, 0.5, 0.75, 0.9, 0.998, 1)])
    free = bent(mujoco.MjModel.from_xml_string(BENDING))
    assert found[-1] == pytest.approx(free, rel=1e-9)
    assert abs(found[0]) < 1e-3 * free
    assert (np.diff(found) > 0).all()
    assert found[3] > 0.1 * free
    assert found[-1] - found[-2] < 0.01 * free


def test_the_way_back_takes_hold_as_the_way_there_lets_go():
    there, back = Evolution(STIFF, BENDING), Evolution(BENDING, STIFF)
    for alpha in np.linspace(0, 1, 9):
        assert bent(back.model(1 - alpha)) == pytest.approx(bent(there.model(alpha)), rel=1e-6)


def test_what_holds_it_falls_by_the_same_factor_in_every_step():
    evolve = Evolution(STIFF, BENDING)
    armature = [evolve.model(a).joint("wrist").armature[0] for a in np.linspace(0, 0.5, 9)]
    np.testing.assert_allclose(np.diff(np.log10(armature)), -0.5, atol=1e-3)


def test_an_f_of_ones_own_moves_it_too_and_the_ends_stay():
    late = Evolution(STIFF, BENDING, f=lambda alpha: max(0.0, 2 * alpha - 1))
    plain = Evolution(STIFF, BENDING)
    for alpha, same in ((0.3, 0.0), (0.75, 0.5), (1.0, 1.0)):
        held = (one.joint("wrist").armature for one in (late.model(alpha), plain.model(same)))
        np.testing.assert_array_equal(*held)
