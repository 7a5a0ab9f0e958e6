"""Robots as others ship them: any two make a path whose ends move as they do, or are refused."""

import itertools
import random
from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import RevolverError

FILES = {
    "dm_control": "suite/walker suite/cheetah suite/hopper suite/acrobot suite/finger suite/fish"
    " suite/reacher suite/humanoid suite/quadruped suite/manipulator suite/dog suite/swimmer"
    " suite/ball_in_cup third_party/ant/ant third_party/kinova/jaco_hand"
    " locomotion/walkers/assets/rodent locomotion/walkers/assets/humanoid_CMU_V2020"
    " locomotion/soccer/assets/boxhead/boxhead",
    "gymnasium": " ".join(f"envs/mujoco/assets/{name}" for name in (
        "ant", "half_cheetah", "hopper", "humanoid", "pusher_v5", "reacher", "swimmer", "walker2d",
        "inverted_double_pendulum")),
    "gymnasium_robotics": "envs/assets/adroit_hand/adroit_pen envs/assets/hand/reach"
    " envs/assets/fetch/pick_and_place envs/assets/point/point",
}  # fmt: skip
TABLE = {f"{package}/{name.split('/')[-1]}": (package, name)
         for package, names in FILES.items() for name in names.split()}  # fmt: skip
PAIRS = list(itertools.permutations(TABLE, 2))
random.Random(0).shuffle(PAIRS)
pytestmark = pytest.mark.filterwarnings("ignore:.*settotalmass:UserWarning")


def path_of(key):
    package, name = TABLE[key]
    return Path(find_spec(package).origin).parent / f"{name}.xml"


def given(key):
    return mujoco.MjModel.from_xml_path(str(path_of(key)))


def robot(key):
    """As an MjSpec, which may name files anywhere: some of these keep their meshes elsewhere."""
    return mujoco.MjSpec.from_file(str(path_of(key)))


def places(model, names, steps=40):
    """Where bodies are after so many steps at rest."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=steps)
    return np.array([data.body(name).xpos for name in names])


def is_squeezed(model):
    """Whether bodies begin more than a millimetre inside each other, and burst apart."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return bool(np.any(data.contact.dist < -1e-3))


def makes_a_path(source, target):
    """Whether there is one; it then begins as the source does."""
    try:
        evolve = rvl.Evolution(robot(source), robot(target), unnamed="number", switch=0.5)
    except RevolverError:
        return False
    alone, both = given(source), [a for a, b in evolve.matching.bodies if a and b]
    named = {alone.body(i).name for i in range(alone.nbody)}
    both = [name for name in both if name in named]
    if not is_squeezed(alone):
        expected = places(alone, both)
        np.testing.assert_allclose(places(evolve.model(0.0), both), expected, atol=1e-3)
    assert np.isfinite(evolve.theta(0.5)).sum() == np.isfinite(evolve.theta(0.0)).sum()
    evolve.model(0.5)
    return True


@pytest.mark.parametrize("key", TABLE)
def test_a_robot_is_a_path_to_itself_that_stands_still(key):
    evolve = rvl.Evolution(robot(key), robot(key), unnamed="number")
    assert not evolve.theta_changed.any()
    alone = mujoco.MjData(given(key))
    ours = mujoco.MjData(evolve.model(0.5))
    for data in (alone, ours):
        mujoco.mj_step(data.model, data, nstep=20)
    np.testing.assert_array_equal(ours.qpos, alone.qpos)


@pytest.mark.parametrize(("source", "target"), PAIRS[:16])
def test_two_robots_make_a_path_that_begins_as_the_first_or_are_refused(source, target):
    makes_a_path(source, target)


@pytest.mark.slow
def test_of_all_pairs_more_than_half_make_a_path():
    assert sum(makes_a_path(*pair) for pair in PAIRS[:300]) > 150
