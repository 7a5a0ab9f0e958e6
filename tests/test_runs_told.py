"""What is told of a run is of that run: its reward, its expert, its learners' times, its counts."""

import csv
import dataclasses
import json
import shutil
import time

import numpy as np
import pytest
from small_runs import tiny_plan

from revolver_lab.errors import SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.files import asset_folder
from revolver_lab.gates import SampledGate
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.logs import write_table
from revolver_lab.natural_methods import NaturalMethod
from revolver_lab.runs import Plan, Run, recorded, store, worker
from revolver_lab.runs.markdown import markdown
from revolver_lab.runs.summary import describe, rows, success_return
from revolver_lab.weights import digest

ROBOT = "cheetah-front-leg"
NATURAL = NaturalMethod(
    name="tiny", gate=SampledGate(alpha_start=1.0), expert=False, least_return=1.0,
    settings=NaturalSettings(trajectories=4, length=50, warm_batches=1, value_hidden=(8,)),
)  # fmt: skip


@pytest.fixture
def run(tmp_path):
    """A copy of a recorded run of the cheetah."""
    (shipped,) = asset_folder("results").glob(f"{ROBOT}-ee35d0bd66ac")
    return shutil.copytree(shipped, tmp_path / shipped.name)


def altered(run, name, **changes):
    path = run / name
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_half_of_home_is_of_the_reward_that_the_expert_was_measured_by(run):
    home = load_expert(ROBOT).card.episode_return
    assert success_return(Run.open(run).results()) == home / 2
    altered(run, store.CONFIG, task="dense")
    results = Run.open(run).results()
    assert success_return(results) is None
    assert "success: a mean return" not in describe(results)
    assert {row["success"] for row in rows(results)} == {None}
    assert "| - |" in markdown(results)
    assert rows(results, threshold=1.0)[0]["threshold"] == 1.0
    together = recorded(ROBOT, folder=run.parent, settings={"task": "dense"})
    assert success_return(together) is None


@pytest.mark.parametrize("changes", [{"robot": "cheetah-segment"}, {"alpha": 1.0}])
def test_an_expert_of_another_robot_says_nothing_of_home(changes, tmp_path):
    shipped = load_expert(ROBOT)
    own = shipped.with_card(dataclasses.replace(shipped.card, **changes))
    found = []
    for name, expert in (("shipped", shipped), ("own", own)):
        run = Run(tiny_plan(expert=digest(expert.weights), seeds=[0]), root=tmp_path / name,
                  expert=expert)  # fmt: skip
        run.prepare(1)
        assert worker.train(run.folder, 0, 1e9) == 0
        found.append(run.results())
    assert [each.expert_return for each in found] == [shipped.card.episode_return, None]
    assert [each.expert_steps for each in found] == [shipped.card.steps] * 2


@pytest.mark.parametrize("processes", [1, 2])
def test_a_natural_learner_took_its_own_time_and_a_run_that_of_its_busiest_worker(
    processes, tmp_path
):
    plan = Plan(robot=ROBOT, methods=[NATURAL], seeds=[0, 1, 2, 3], steps=600, evaluate_episodes=2)
    run = Run(plan, root=tmp_path)
    run.prepare(processes)
    begun = time.monotonic()
    for shard in range(processes):
        assert worker.train(run.folder, shard, 1e9) == 0
    took = time.monotonic() - begun
    results = run.results()
    with open(run.folder / store.ITERATIONS, newline="") as file:
        last = {int(row["seed"]): float(row["wall_time"]) for row in csv.DictReader(file)}
    own = [one.cost.seconds for one in results.learners]
    assert all(seconds > 0.9 * last[seed] for seed, seconds in enumerate(own))
    assert results.cost.seconds == pytest.approx(sum(own))
    assert results.cost.seconds < took
    busiest = max(sum(own[shard::processes]) for shard in range(processes))
    assert store.read_json(run.folder / store.CARD)["wall_time"] == pytest.approx(busiest, abs=0.01)
    assert run.status().seconds == pytest.approx(busiest, abs=0.01)


def test_learners_evaluated_with_more_episodes_than_others_are_put_together_all_the_same(run):
    other = shutil.copytree(run, run.parent / f"{ROBOT}-more")
    altered(other, store.CONFIG, evaluate_episodes=20, seeds=[*range(10, 20)])
    altered(other, store.CARD, digests={})
    for name in (store.LEARNERS, store.PHASES, store.EVALUATIONS):
        with open(other / name, newline="") as file:
            table = [*csv.DictReader(file)]
        for row in table:
            row["seed"] = int(row["seed"]) + 10
            if name == store.EVALUATIONS:  # twice as many, and two better each
                row["returns"] += " " + " ".join(str(float(r) + 4) for r in row["returns"].split())
        write_table(other / name, table)
    together, alone = recorded(ROBOT, folder=run.parent), Run.open(run).results()
    for method in alone.methods:
        scores = alone.finals(method).mean(axis=1)
        assert together.scores()[method] == pytest.approx([*scores, *(scores + 2)])
        with pytest.raises(SettingsError, match=r"differ in evaluate_episodes \(\[10, 20\] of"):
            together.finals(method)
    assert "20" in describe(together).splitlines()[1]
    apart = recorded(ROBOT, folder=run.parent, settings={"evaluate_episodes": 20})
    assert apart.finals(method).shape == (10, 20)


def test_curves_of_other_steps_are_not_drawn_over_these(run):
    results = Run.open(run).results()
    first, *rest = results.learners
    for steps in (first.steps + 1, first.steps[:-1]):
        changed = dataclasses.replace(first, steps=steps, curve=first.curve[: len(steps)])
        mixed = dataclasses.replace(results, learners=(changed, *rest))
        with pytest.raises(SettingsError, match="differ in evaluate_every"):
            mixed.curve(first.method)
    assert np.array_equal(results.curve(first.method)[0], first.steps)
