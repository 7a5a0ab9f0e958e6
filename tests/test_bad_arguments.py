"""Whatever a notebook passes by mistake is taken, or refused in words that say what to do."""

import dataclasses
import inspect

import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab import _gl, gates
from revolver_lab.envs.single import RobotEnv
from revolver_lab.errors import RevolverError
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.robots import registry
from revolver_lab.runs import Plan

NAME = "cheetah-front-leg"
MISTAKES = (None, float("nan"), float("inf"), -1, 1.5, 1e300, True, "", "x", "2", b"x", [], {}, (),
            [None], ["a", "b"], [0.5, "a"], {1: 2}, object(), lambda *_: 0)  # fmt: skip
SMALL = {"width": 32, "height": 24, "camera": "fit"}
needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")


def settings_of(kind):
    return kind, {field.name: getattr(kind(), field.name) for field in dataclasses.fields(kind)}


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    """Name -> a function, and arguments that it takes."""
    policy, robot = rvl.load_expert(NAME), registry.get(NAME)
    rollout = rvl.lab.record(policy, NAME, 0.5, steps=3)
    path = tmp_path_factory.mktemp("films") / "x.gif"
    made = {"source": robot.source(), "target": robot.target()}
    usual = inspect.signature(rvl.Evolution).parameters.items()
    made |= {name: one.default for name, one in usual if one.default is not one.empty}
    scores = np.arange(5.0)
    return {
        "Evolution": (rvl.Evolution, made),
        "RobotEnv": (RobotEnv, {"robot": NAME, "alpha": 0.5, "task": None}),
        "make_vec_env": (rvl.make_vec_env, {"robot": NAME, "n": 2, "alphas": 0.5, "task": None,
                                            "seed": 0, "autoreset_mode": "SameStep"}),
        "evaluate": (rvl.evaluate, {"policy": policy, "evolve": NAME, "alphas": [0.5],
                                    "episodes": 1, "seed": 0, "task": None}),
        "Plan": (Plan, {"robot": NAME, "methods": ("direct",), "seeds": (0,), "steps": 8000}),
        "record": (rvl.lab.record, {"policy": policy, "evolve": NAME, "alpha": 0.5, "task": None,
                                    "seed": 0, "steps": 2}),
        "explore": (rvl.lab.explore, {"evolve": NAME, "policy": policy, "alpha": 0.5}),
        "strip": (rvl.lab.strip, {"evolve": NAME, "alphas": [0.5], "path": None, **SMALL}),
        "film": (rvl.lab.film, {"shown": [rollout], "path": path, "fps": 5, "speed": 1, **SMALL}),
        "static_slider": (rvl.lab.static_slider, {"evolve": NAME, "frames": 2, **SMALL}),
        "compare": (rvl.lab.compare, {"rollouts": [rollout], "fps": 5, "speed": 1, **SMALL}),
        "interval": (rvl.stats.interval, {"scores": scores, "statistic": "iqm",
                                          "confidence": 0.9}),
        "paired": (rvl.stats.paired, {"x": scores, "y": scores[::-1]}),
        "ramp": (rvl.ramp, {"start": 0.0, "stop": 0.5}),
        **{kind.__name__: settings_of(kind) for kind in (
            NaturalSettings, LearnerSettings, gates.SampledGate, gates.EvaluatedGate, rvl.Schedule
        )},
    }  # fmt: skip


def refuses_or_takes_one_mistake_at_a_time(call, right):
    """Every error is one of ours, and says what is allowed; there are enough of them."""
    refused = []
    for argument in right:
        for mistake in MISTAKES:
            try:
                call(**{**right, argument: mistake})
            except RevolverError as error:
                refused.append(str(error))
    assert len(refused) > len(MISTAKES) // 2
    assert all("Allowed:" in words for words in refused)


PLAIN = ("Evolution", "RobotEnv", "make_vec_env", "evaluate", "Plan", "record", "explore",
         "interval", "paired", "ramp", "NaturalSettings", "LearnerSettings", "SampledGate",
         "EvaluatedGate", "Schedule")  # fmt: skip
DRAWN = ("strip", "film", "static_slider", "compare")


@pytest.mark.parametrize("name", [*PLAIN, *(pytest.param(name, marks=needs_gl) for name in DRAWN)])
def test_one_wrong_argument_is_refused_in_our_words_or_taken(calls, name):
    call, right = calls[name]
    call(**right)
    refuses_or_takes_one_mistake_at_a_time(call, right)
