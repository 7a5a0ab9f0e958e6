"""A lifted policy acts on the padded robot as it did on the robot."""

import mujoco
import numpy as np
import pytest

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.lifting import insert_zeros, lift
from revolver_lab.evolution.matching import match
from revolver_lab.evolution.padding import pad
from revolver_lab.evolution.reading import read_robot

ARM = (
    "<mujoco><worldbody><body name='a'><joint name='a' axis='0 1 0'/>"
    "<geom type='capsule' fromto='0 0 0 0 0 .5' size='.05'/>{}<body name='b' pos='0 0 .5'>"
    "<joint name='b' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 .5' size='.05'/></body>"
    "</body></worldbody><actuator>{}<motor name='a' joint='a'/><motor name='b' joint='b'/>"
    "</actuator></mujoco>"
)
THIRD = "<body name='z' pos='0 0 .2'><joint name='z' axis='1 0 0'/><geom size='.1'/></body>"


@pytest.fixture(name="twins")
def _twins():
    source = read_robot(ARM.format("", ""))
    target = read_robot(ARM.format(THIRD, "<motor name='z' joint='z'/>"))
    return source.compile(), pad(source, target, match(source, target)).source.compile()


def test_a_lifted_linear_policy_drives_the_padded_robot_along_the_same_path(twins):
    robot, padded = twins
    places = lift(robot, padded)
    gains = np.random.default_rng(0).normal(size=(robot.nu, robot.nq + robot.nv))
    columns = np.concatenate([places.qpos, padded.nq + places.qvel])
    lifted = insert_zeros(gains, columns, padded.nq + padded.nv)
    lifted = insert_zeros(lifted, places.ctrl, padded.nu, axis=0)
    data = mujoco.MjData(robot), mujoco.MjData(padded)
    data[0].qpos[:] = 0.3, -0.2
    data[1].qpos[:], data[1].qvel[:] = places.state(data[0].qpos, data[0].qvel)
    for _ in range(200):
        for model, state, weights in zip((robot, padded), data, (gains, lifted)):
            state.ctrl[:] = weights @ np.concatenate([state.qpos, state.qvel])
            mujoco.mj_step(model, state)
        np.testing.assert_allclose(data[0].ctrl, data[1].ctrl[places.ctrl], atol=1e-9)
    np.testing.assert_allclose(data[0].qpos, data[1].qpos[places.qpos], atol=1e-9)
    assert data[1].ctrl[padded.actuator("z").id] == 0.0


def test_controls_are_lifted_row_by_row(twins):
    places = lift(*twins)
    controls = np.arange(6.0).reshape(3, 2)
    assert places.control(controls).shape == (3, 3)
    np.testing.assert_array_equal(places.control(controls)[:, places.ctrl], controls)


@pytest.mark.parametrize("places", [[0, 0], [0, 5], [0], [-1, 1]])
def test_places_that_cannot_be_are_refused(places):
    with pytest.raises(MatchingError, match="one place in"):
        insert_zeros(np.ones(2), places, 3)


def test_a_foreign_robot_is_not_lifted(twins):
    with pytest.raises(MatchingError, match="padded twin"):
        lift(twins[1], twins[0])
