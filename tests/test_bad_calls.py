"""What is passed by mistake to runs, learners or statistics is taken, or refused in words."""

import dataclasses

import numpy as np
import pytest
import torch
from natural_puck import EXPERT, LENGTH, Reach
from natural_puck import puck as natural_puck
from small_runs import DIRECT, TINY_RUN, puck, tiny_plan
from test_bad_arguments import refuses_or_takes_one_mistake_at_a_time, settings_of
from test_transfer import TINY, PushRight

import revolver_lab as rvl
from revolver_lab import stats
from revolver_lab.demonstration_sources import record
from revolver_lab.errors import SettingsError
from revolver_lab.gates import EvaluatedGate, SampledGate, SteppedGate, gate_from_json
from revolver_lab.learners.natural.algorithms import make_learner
from revolver_lab.learners.natural.cloning import gaussian_clone
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.methods import Method
from revolver_lab.natural_methods import NaturalMethod
from revolver_lab.natural_transfer import natural_transfer
from revolver_lab.runs import Run
from revolver_lab.runs.sweep import sweep

NATURAL = NaturalSettings(trajectories=2, length=LENGTH, value_hidden=(4,), warm_batches=0)


def usual_of(kind, **made):
    """A dataclass, and arguments that it takes."""
    one = kind(**made)
    return kind, {field.name: getattr(one, field.name) for field in dataclasses.fields(kind)}


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    """Name -> a function, and arguments that it takes."""
    robot, shown = natural_puck(), record(EXPERT, natural_puck(), 2, task=Reach())
    curve, run = stats.kaplan_meier([1, 2], [1, 0]), Run(tiny_plan())
    start = {"schedule": DIRECT, "learner": TINY, "steps": 36, "evaluate_every": 18,
             "evaluate_episodes": 1, "seed": 0, "keep_best": False, "progress": None}  # fmt: skip
    carry = {"gate": SampledGate(), "algorithm": "NPG", "settings": NATURAL, "steps": 40, "seed": 0,
             "demonstrations": None, "success": None, "evaluate_episodes": 1, "nthread": 1,
             "report": None}  # fmt: skip
    return {
        "Run": (Run, {"plan": tiny_plan(), "root": tmp_path_factory.mktemp("runs"),
                      "expert": None}),
        "open": (Run.open, {"folder": rvl.files.asset_folder("results")
                            / "adroit-door-fingers-87c20ef7e340"}),
        "sweep": (sweep, {"plans": [], "root": tmp_path_factory.mktemp("runs"), "jobs": 1,
                          "cluster": None, "every": 60.0, "told": None}),
        "start": (_checked_only(run), {"processes": 1, "every": 60.0}),
        "transfer": (lambda **given: rvl.transfer(None, puck(), task=PushRight(), **given), start),
        "natural_transfer": (
            lambda **given: natural_transfer(None, robot, task=Reach(), **given), carry,
        ),
        "make_learner": (make_learner, {
            "algorithm": "NPG", "observation_size": 2, "action_size": 2, "settings": NATURAL,
            "demonstrations": None, "seed": 0,
        }),
        "gaussian_clone": (gaussian_clone, {
            "policy": EXPERT, "demonstrations": shown, "seed": 0, "hidden": (4,), "epochs": 1,
            "floor": -3.0,
        }),
        "gate_from_json": (gate_from_json, {"value": SampledGate().to_json()}),
        "restricted_mean": (stats.restricted_mean, {"curve": curve, "until": 1.0}),
        "time_to_threshold": (stats.time_to_threshold, {"steps": [1, 2], "returns": [1.0, 2.0],
                                                        "threshold": 2.0}),
        "optimality_gap": (stats.optimality_gap, {"scores": [1.0, 2.0], "wanted": 1.0}),
        "Method": usual_of(Method, name="mine", schedule=TINY_RUN.schedule),
        "NaturalMethod": usual_of(NaturalMethod, name="mine"),
        "LearnerSettings": settings_of(LearnerSettings),
    }  # fmt: skip


def _checked_only(run):
    """Starting a run, but for its workers."""

    def start(**given):
        run.prepare = run._spawn = lambda *_: None
        return run.start(**given)

    return start


@pytest.mark.parametrize(
    "name", ["Run", "open", "sweep", "start", "transfer", "natural_transfer", "make_learner",
             "gaussian_clone", "gate_from_json", "restricted_mean", "time_to_threshold",
             "optimality_gap", "Method", "NaturalMethod", "LearnerSettings"]
)  # fmt: skip
def test_one_wrong_argument_of_a_call_is_refused_in_our_words_or_taken(
    calls, name, tmp_path, monkeypatch
):
    call, right = calls[name]
    call(**right)
    monkeypatch.chdir(tmp_path)  # some mistakes are names of folders
    refuses_or_takes_one_mistake_at_a_time(call, right)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: natural_transfer(EXPERT, natural_puck(), task=Reach(), out=5), "out = 5"),
        (lambda: rvl.transfer(None, puck(), task=PushRight(), out=5), "out = 5"),
        (
            lambda: rvl.evaluate(EXPERT, natural_puck(), 0.0, 10**20, task=Reach()),
            "1 to 1000000000",
        ),
        (
            lambda: rvl.transfer(None, puck(), task=PushRight(), evaluate_episodes=10**20),
            "0 to 1000000000",
        ),
        (lambda: sweep("x"), "plan = 'x'"),
        (lambda: sweep(tiny_plan()), "plans = "),
        (lambda: Run(None), "plan = None"),
        (lambda: make_learner("NPG", 0, 2), "observation_size = 0"),
        (lambda: make_learner("NPG", 2, 0), "action_size = 0"),
        (lambda: make_learner("NPG", 2, 2, seed=-1), "seed = -1"),
        (lambda: stats.restricted_mean(stats.kaplan_meier([1], [1]), [1.0]), r"until of shape \(1"),
        (lambda: stats.time_to_threshold([1], [1], [1]), r"threshold of shape \(1"),
        (lambda: stats.paired({0: 1, "a": 2}, {1: 1}), "seeds "),
        (lambda: stats.paired({0: 1, "a": 2}, {0: 1, "a": 2}), "whole numbers"),
        (lambda: Method(name="x", schedule=rvl.Schedule(), expert="no"), "expert = 'no'"),
        (lambda: LearnerSettings(device="tpu"), "device = 'tpu'"),
        (lambda: LearnerSettings(layer_norm="yes"), "layer_norm = 'yes'"),
        (lambda: LearnerSettings(options=None), "options = None"),
    ],
)
def test_what_is_wrong_is_named(call, name):
    with pytest.raises(SettingsError, match=name):
        call()


@pytest.mark.parametrize("kind", [SampledGate, SteppedGate, EvaluatedGate])
def test_a_gate_with_a_field_that_it_does_not_have_is_refused_with_those_it_has(kind):
    with pytest.raises(SettingsError, match=r"\['zz'\].*alpha_step"):
        gate_from_json({**kind().to_json(), "zz": 1})


@pytest.mark.parametrize(("device", "there"), [("cuda", 0), ("cuda:1", 1), ("cuda:0", 0)])
def test_a_device_that_is_not_there_is_refused_before_anything_is_put_on_it(
    device, there, monkeypatch
):
    monkeypatch.setattr(torch.cuda, "device_count", lambda: there)
    settings = dataclasses.replace(TINY, device=device)
    with pytest.raises(SettingsError, match=f"{device}.*{there} CUDA devices"):
        rvl.transfer(None, puck(), DIRECT, task=PushRight(), learner=settings)


def test_seeds_of_whatever_whole_type_are_the_same_seeds():
    plain = stats.paired({0: 5.0, 1: 7.0, 10: 6.0}, {0: 4.0, 1: 5.0, 10: 3.0})
    typed = stats.paired({np.int64(k): v for k, v in ((10, 6.0), (0, 5.0), (1, 7.0))},
                         {0: 4.0, 1: 5.0, 10: 3.0})  # fmt: skip
    assert (plain.p, plain.difference) == (typed.p, typed.difference)
