"""Both ends of a path feel what the two robots feel, or the difference is refused."""

import mujoco
import numpy as np
import pytest
from test_uncommon_parts import robot

import revolver_lab as rvl
from revolver_lab.errors import ParameterError


def felt(model, steps=60):
    """What a robot's sensors say while it is moved, (steps, nsensordata)."""
    data, rng, found = mujoco.MjData(model), np.random.default_rng(0), []
    for _ in range(steps):
        data.ctrl[:] = rng.uniform(-5, 5, model.nu)
        mujoco.mj_step(model, data)
        found.append(data.sensordata.copy())
    return np.array(found)


def gyro(more=""):
    return robot(rest=f"<sensor><gyro name='g' site='s2' {more}/></sensor>")


def touch(more):
    """A box that lies on the floor, and what it feels there."""
    box = "<freejoint name='x'/><geom name='x' type='box' size='.05 .05 .05'/>"
    box = f"<body name='x' pos='1 0 .049'>{box}</body>"
    return robot(scene=box, rest=f"<sensor><contact name='c' geom1='x' {more}/></sensor>")


def distance(cutoff):
    sensor = f"<distance name='d' geom1='f2' geom2='floor' cutoff='{cutoff}'/>"
    return robot(rest=f"<sensor>{sensor}</sensor>")


BUFFER = "nsample='20'"
GRADUAL = {
    "cutoff": (gyro("cutoff='.2'"), gyro("cutoff='.1'")),
    "the reach of a distance": (distance(2), distance(0.5)),
    "delay": (gyro(BUFFER), gyro(BUFFER + " delay='.02'")),
    "interval": (gyro(BUFFER + " interval='.01'"), gyro(BUFFER + " interval='.02 -.01'")),
}


@pytest.mark.parametrize("name", GRADUAL)
def test_what_a_sensor_says_changes_gradually_and_both_ends_feel_as_the_two_robots(name):
    evolve = rvl.Evolution(*GRADUAL[name])
    alone = [felt(mujoco.MjModel.from_xml_string(text)) for text in GRADUAL[name]]
    assert np.abs(alone[0] - alone[1]).max() > 1e-3
    for alpha in (0, 1):
        np.testing.assert_array_equal(felt(evolve.model(alpha)), alone[alpha])
    halves = [evolve.model(alpha) for alpha in (0.0, 0.5, 1.0)]
    for field in ("cutoff", "delay", "interval"):
        a, half, b = (getattr(model, f"sensor_{field}") for model in halves)
        np.testing.assert_allclose(half, (a + b) / 2)


def test_the_noise_of_a_sensor_is_the_two_robots_at_the_ends():
    evolve = rvl.Evolution(gyro(), gyro("noise='.5'"))
    noises = [evolve.model(alpha).sensor_noise.tolist() for alpha in (0.0, 0.5, 1.0)]
    assert noises == [[0.0], [0.25], [0.5]]


SWITCHED = {
    "g/cutoff": (gyro(), gyro("cutoff='.1'")),
    "c/intprm": (touch("data='force' reduce='maxforce'"), touch("data='force' reduce='netforce'")),
}


@pytest.mark.parametrize("name", SWITCHED)
def test_a_sensor_that_changes_its_kind_is_refused_by_name_or_switches(name):
    ends = SWITCHED[name]
    with pytest.raises(ParameterError, match=f"sensor/{name}: .* -> "):
        rvl.Evolution(*ends)
    evolve = rvl.Evolution(*ends, switch={f"sensor/{name}": 0.5})
    one, other = (felt(mujoco.MjModel.from_xml_string(text)) for text in ends)
    assert np.abs(one - other).max() > 1e-3
    for alpha, alone in ((0.0, one), (0.49, one), (0.5, other), (1.0, other)):
        np.testing.assert_array_equal(felt(evolve.model(alpha)), alone)


@pytest.mark.parametrize(
    ("ends", "told", "counted"),
    [
        ((gyro(), gyro(BUFFER)), "g/nsample", "nhistory"),
        ((touch("data='force'"), touch("data='found force'")), "c/intprm", "nsensordata"),
        ((touch("num='1'"), touch("num='2'")), "c/intprm", "nsensordata"),
        (
            [robot(rest=f"<sensor><user name='u' dim='{n}'/></sensor>") for n in (3, 5)],
            "u/dim", "nsensordata",
        ),
    ],
)  # fmt: skip
def test_a_sensor_that_says_more_is_refused_by_name(ends, told, counted):
    with pytest.raises(ParameterError, match=f"sensor/{told}: "):
        rvl.Evolution(*ends)
    with pytest.raises(ParameterError, match=counted):
        rvl.Evolution(*ends, switch=0.5)


@pytest.mark.parametrize("back", [False, True])
def test_a_sensor_that_one_robot_has_alone_is_created_where_nothing_else_is(back):
    ends = [robot(), gyro()][:: -1 if back else 1]
    evolve = rvl.Evolution(*ends)
    alone = felt(mujoco.MjModel.from_xml_string(gyro()))
    assert np.abs(alone).max() > 1e-3
    for alpha in (0.0, 1.0):
        np.testing.assert_array_equal(felt(evolve.model(alpha)), alone)
