"""Populations and plans that take milliseconds or seconds, and how two of their results differ."""

import dataclasses
import json

import numpy as np
from test_transfer import PATH, PUCK, TINY, PushRight

from revolver_lab.evolution.evolution import Evolution
from revolver_lab.learners.settings import COURSE
from revolver_lab.methods import Method
from revolver_lab.policies import Policy
from revolver_lab.population import Population
from revolver_lab.runs import Plan, checkpoint
from revolver_lab.schedule import Adaptive, Schedule
from revolver_lab.weights import digest

ROBOT = "cheetah-front-leg"
DIRECT = Method(name="direct", schedule=Schedule(alpha_start=1.0, xi=0.0, final_episodes=12))
MANY = (
    Method(name="shaped", schedule=PATH),
    Method(name="plain", schedule=dataclasses.replace(PATH, shaping=0.0, xi=0.0,
                                                      episodes_per_phase=4)),
    Method(name="adaptive", optimiser="fresh",
           schedule=dataclasses.replace(PATH, adaptive=Adaptive(ratio=1.0, episodes_limit=6))),
    DIRECT,
)  # fmt: skip
TINY_RUN = Method(name="tiny", schedule=Schedule(
    alpha_start=0.5, alpha_step=0.5, xi=0.6, episodes_per_phase=8, final_episodes=8
))  # fmt: skip
EAGER = dataclasses.replace(COURSE, learning_starts=100, batch_size=16)


def puck():
    return Evolution(PUCK.format(mass=1, gear=5), PUCK.format(mass=4, gear=5), name="puck")


def population(evolve, members, settings=TINY, *, task=None, **changes):
    arguments = {"evaluate_every": 30, "evaluate_episodes": 2} | changes
    return Population(evolve, members, settings=settings, task=task or PushRight(), **arguments)


def tiny_plan(**changes):
    """Two learners, 400 ticks, about two seconds; they learn from tick 13 on."""
    plan = {"robot": ROBOT, "methods": [TINY_RUN], "seeds": [0, 1], "steps": 3200,
            "learner": EAGER, "evaluate_every": 1600, "evaluate_episodes": 2}  # fmt: skip
    return Plan(**(plan | changes))


def ticks(count):
    """Asks to pause after so many ticks."""
    left = iter(range(count))
    return lambda: next(left, None) is None


def through_files(old, new, folder):
    """Hands a population's state to another through a checkpoint."""
    checkpoint.save(old, folder)
    assert checkpoint.restore(new, folder)
    return new


_PASSING = ("seconds", "wall_time", "commit")


def timeless(value):
    """Plain values without those that tell the time or the commit, as text."""

    def strip(item):
        if isinstance(item, dict):
            return {k: strip(v) for k, v in item.items() if k not in _PASSING}
        return [strip(i) for i in item] if isinstance(item, list | tuple) else item

    return json.dumps(strip(value), sort_keys=True)


def assert_same(one, other):
    """All that two populations are is the same, bit for bit, but for the time it took."""
    (arrays, plain), (others, other_plain) = one.state(), other.state()
    assert set(arrays) == set(others)
    for name, array in arrays.items():
        assert array.dtype == others[name].dtype, name
        assert np.array_equal(array, others[name], equal_nan=True), name
    assert timeless(plain) == timeless(other_plain)


def files_of(folder):
    """What a finished run holds, but for when and from which commit: name -> plain value."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != "card.json" and not path.name.startswith("."):
            found[str(path.relative_to(folder))] = _READ[path.suffix](path)
    return found


def _read_table(path):
    rows = [row.split(",") for row in path.read_text().splitlines()]
    clock = [k for k, column in enumerate(rows[0]) if column == "wall_time"]
    return [[cell for k, cell in enumerate(row) if k not in clock] for row in rows]


def _read_json(path):
    return json.loads(path.read_text()) | {"commit": ""}


def _read_policy(path):
    policy = Policy.load(path)
    return digest(policy.weights), policy.card.to_json() | {"commit": ""}


_READ = {".csv": _read_table, ".json": _read_json, ".safetensors": _read_policy}
