"""What is shipped as recorded: whole, small, repeatable, and what the pages say of it."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from revolver_lab import stats
from revolver_lab.experts import load_expert
from revolver_lab.files import asset_folder
from revolver_lab.runs import recorded, store
from revolver_lab.runs.markdown import markdown
from revolver_lab.runs.natural_summary import is_natural, natural_rows
from revolver_lab.runs.recordings import recorded_kinds
from revolver_lab.runs.sweep_file import read_sweep
from revolver_lab.runs.tables import read_results
from revolver_lab.tasks.locomotion import AntRun

ROOT = Path(__file__).parent.parent
FOLDERS = sorted(path.parent for path in asset_folder("results").glob(f"*/{store.CARD}"))
PLANS = [store.read_plan(folder) for folder in FOLDERS]
NATURAL = [plan for plan in PLANS if plan.learner is None]
HAND = (ROOT / "docs" / "hand.md").read_text() if NATURAL else ""
PAGE = (ROOT / "docs" / "results.md").read_text()
SECTIONS = re.findall(r"^### ([a-z-]+):.*\n((?:.|\n)*?)(?=^### |\Z)", PAGE, re.M)
ROW = re.compile(r"\| ([\w.-]+) \| ([\d.]+) \(([\d.]+) to ([\d.]+)\) \| (\d+) of (\d+) \|")


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_a_recorded_run_is_whole_small_and_says_how_to_repeat_it(folder):
    plan, card = store.read_plan(folder), store.read_json(folder / store.CARD)
    results = read_results(folder)
    assert folder.name == plan.name  # the hash still names it: the plan reads as it was written
    assert len(results.learners) == len(plan.members)
    natural = plan.learner is None
    least = 5 if natural else 10
    assert all(len(_seeds(plan, method)) >= least for method in plan.methods)
    assert not card["failures"]
    assert card["command"].startswith("revolver-lab transfer")
    assert re.fullmatch(r"[0-9a-f]{12}", card["commit"])
    assert {"mujoco", "revolver-lab"} <= set(card["versions"])
    assert natural or "torch" in card["versions"]
    assert sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) < 500_000
    for path in folder.rglob("*.json"):
        assert not re.search(r"/(work|tmp|home|root)/", path.read_text())
    for one in results.learners:
        assert one.cost.steps == plan.steps or (natural and (one.finished or _is_last(one, plan)))
        assert one.returns.shape == (plan.evaluate_episodes,)
        assert np.isfinite(one.curve).all()


def _seeds(plan, method):
    """The seeds of a method in all that is recorded like a plan: seeds may be trained apart."""
    alike = ("robot", "task", "learner", "expert")
    return {seed for other in PLANS for seed in other.seeds if method in other.methods
            and all(getattr(other, name) == getattr(plan, name) for name in alike)}  # fmt: skip


def _is_last(one, plan):
    """Whether a learner's last iteration is the one that reaches the budget."""
    before = one.iterations[-2]["steps"] if len(one.iterations) > 1 else 0
    return before < plan.steps <= one.cost.steps


@pytest.mark.parametrize("robot", sorted({plan.robot for plan in NATURAL}))
def test_the_pages_tables_of_natural_methods_are_what_is_recorded(robot):
    for title, results in recorded_kinds(robot):
        if is_natural(results):
            assert markdown(results) in (HAND if robot.startswith("adroit") else PAGE), title


def test_the_campaigns_train_again_what_is_recorded_of_the_hand():
    planned = {(plan.robot, plan.task, method, plan.steps)
               for path in (ROOT / "docs" / "campaigns").glob("*.toml") for plan in read_sweep(path)
               for method in plan.methods}  # fmt: skip
    kept = {(plan.robot, plan.task, method, plan.steps) for plan in NATURAL
            for method in plan.methods if plan.robot.startswith("adroit")}  # fmt: skip
    assert kept <= planned


def test_the_door_is_not_opened_after_one_jump_hardly_after_two_and_always_after_four():
    rows = {row["method"]: row for row in natural_rows(recorded("adroit-door", natural=True))}
    assert rows["jumps-1"]["success"] == 0.0
    always = ("jumps-4", "jumps-8", "jumps-16", "xi-0", "xi-0.2", "h-1", "h-1-over-xi",
              "value-without-beta", "npg-revolver")  # fmt: skip
    often = {"jumps-1": 0, "jumps-2": 1, "jumps-64": 7, "step-1e-4": 0, "step-0.02": 9,
             "gate-evaluated-0.05": 9}  # fmt: skip
    good = dict.fromkeys(always, 10) | often
    assert {name: rows[name]["good"] for name in good} == good
    assert {rows[name]["seeds"] for name in good} == {10}
    assert rows["step-1e-4"]["farthest"] < 0.25


@pytest.mark.parametrize(("robot", "met"), [("adroit-door", 1), ("adroit-hammer", 0)])
def test_no_baseline_succeeds_where_completion_only_is_paid_and_next_to_none_meets_it(robot, met):
    found = recorded(robot, ["npg-direct", "npg-scratch", "dapg", "soil"], natural=True)
    assert len(found.learners) == 20
    assert sum(row["episode_return"] > 0 for one in found.learners for row in one.iterations) == met
    assert all(not np.any(scores) for scores in found.scores().values())


def test_the_ball_is_met_without_robots_between_and_yet_no_baseline_carries_it_as_well():
    methods = ["npg-revolver", "npg-direct", "dapg", "soil", "npg-scratch"]
    found = recorded("adroit-relocate-fingers", methods, natural=True)
    good = {row["method"]: row["good"] for row in natural_rows(found)}
    assert good == {"npg-revolver": 5, "npg-direct": 0, "dapg": 0, "soil": 2, "npg-scratch": 0}
    won = {name: np.array([np.mean(one.successes) for one in found.of(name)]) for name in methods}
    assert won["npg-revolver"].min() > max(won["npg-direct"].max(), won["dapg"].max())
    assert (won["soil"] >= won["npg-revolver"].min()).sum() == 2
    assert not won["npg-scratch"].any()
    assert {len(some) for some in won.values()} == {5}


def test_the_ball_comes_to_the_gripper_in_every_seed_and_to_nine_in_ten_in_most():
    rows = natural_rows(recorded("adroit-relocate", ["quiet", "quiet-confirmed"], natural=True))
    found = [
        tuple(row[x] for x in ("method", "good", "seeds", "least", "farthest")) for row in rows
    ]
    assert found == [("quiet", 3, 5, 0.85, 1.0), ("quiet-confirmed", 4, 5, 0.89, 1.0)]


def test_without_robots_between_no_episode_brings_the_ball_in_the_gripper_where_quiet_has_arrived():
    direct = recorded("adroit-relocate", ["npg-direct"], natural=True)
    assert len(direct.learners) == 5
    assert not any(np.any(one.successes) for one in direct.learners)
    paid = np.array([[row["episode_return"] for row in one.iterations] for one in direct.learners])
    assert (paid.size, (paid > 0).sum()) == (1785, 803)
    assert not any(row["success"] for one in direct.learners for row in one.iterations)
    late = paid[:, -40:].mean(axis=1)
    assert (late.min().round(1), late.max().round(1)) == (0.1, 0.9)
    quiet = recorded("adroit-relocate", ["quiet"], natural=True)
    taken = np.median([one.cost.steps for one in quiet.learners])
    assert {one.cost.steps for one in direct.learners} == {taken} == {6_877_440}


def test_where_three_fingers_shrink_direct_opens_the_door_in_four_seeds_and_imitation_in_none():
    good = {row["method"]: row["good"]
            for row in natural_rows(recorded("adroit-door-fingers", natural=True))}  # fmt: skip
    assert good == {"npg-revolver": 10, "npg-direct": 4, "dapg": 0, "soil": 0, "npg-scratch": 0}


def test_with_a_dense_reward_direct_transfer_and_dapg_open_the_door_soil_in_part_scratch_never():
    found = recorded("adroit-door", natural=True, settings={"task": "dense"})
    good = {row["method"]: row["good"] for row in natural_rows(found)}
    assert good == {"npg-direct": 5, "dapg": 5, "soil": 2, "npg-scratch": 0}


@pytest.mark.parametrize(("task", "best"), [("staged", 0.37), ("dense", 0.35)])
def test_no_reward_for_the_way_drives_the_nail_in_the_steps_of_the_hands_between(task, best):
    found = recorded("adroit-hammer", natural=True, settings={"task": task})
    won = {name: [np.mean(one.successes) for one in found.of(name)] for name in found.methods}
    assert {name: len(some) for name, some in won.items()} == dict.fromkeys(won, 5)
    assert set(won) == {"npg-direct", "npg-scratch", "dapg", "soil"}
    assert max(max(some) for some in won.values()) == pytest.approx(best)
    assert sum(x > 0 for some in won.values() for x in some) == {"staged": 4, "dense": 3}[task]


@pytest.mark.parametrize(("task", "good"), [
    ("staged", {"npg-direct": 0, "dapg": 1, "soil": 2, "npg-scratch": 0}),
    ("dense", {"npg-direct": 1, "dapg": 2, "soil": 1, "npg-scratch": 0}),
])  # fmt: skip
def test_no_reward_for_the_way_carries_the_ball_in_every_seed_as_the_hands_between_do(task, good):
    found = recorded("adroit-relocate-fingers", natural=True, settings={"task": task})
    rows = natural_rows(found)
    assert {row["method"]: row["good"] for row in rows} == good
    assert {row["seeds"] for row in rows} == {5}
    sparse = natural_rows(recorded("adroit-relocate-fingers", list(good), natural=True))
    usual = {row["method"]: row["success"] for row in sparse}
    assert {row["method"] for row in rows if row["success"] > usual[row["method"]]} == {"dapg"}


@pytest.mark.parametrize(("robot", "said"), [
    ("adroit-door", "524,000 (it takes 531,840)"), ("adroit-hammer", "1,210,000 (1,232,640)"),
    ("adroit-relocate-fingers", "2,956,800 (2,979,840)"),
    ("adroit-door-fingers", "384,000 (368,640)"),
])  # fmt: skip
def test_the_page_says_how_many_steps_baselines_have_beside_the_median_of_revolver(robot, said):
    budget, taken = (int(x.replace(",", "")) for x in re.findall(r"[\d,]+\d", said))
    found = recorded(robot, ["npg-revolver", "npg-scratch"], natural=True)
    assert np.median([one.cost.steps for one in found.of("npg-revolver")]) == taken
    spent = {one.cost.steps for one in found.of("npg-scratch")}
    assert {budget + -budget % 3840} == spent  # the iteration that reaches it is made whole
    assert said in " ".join((ROOT / "docs" / "hand.md").read_text().split())


def test_where_an_ant_grows_feet_every_seed_of_soil_runs_and_returns_more_than_any_of_direct():
    scores = recorded("ant-leg-emerge", natural=True).scores()
    assert scores["soil"].min() > 1.4 * scores["npg-direct"].max() > AntRun.idle_return
    assert {len(found) for found in scores.values()} == {5}


def test_on_the_ant_every_seed_of_soil_returns_more_than_any_of_direct_and_none_walks():
    scores = recorded("ant-length-mass", natural=True).scores()
    assert scores["soil"].min() > scores["npg-direct"].max()
    assert scores["soil"].max() < AntRun.idle_return


def test_a_single_seed_has_no_interval_in_a_table():
    found = recorded("adroit-door", ["npg-revolver"], natural=True)
    one = dataclasses.replace(found, learners=found.learners[:1])
    assert "| 1.000 (one seed, no interval) | 1.00 | 1 of 1 |" in markdown(one)
    assert "inf" not in markdown(one)


def test_with_stages_in_its_reward_direct_transfer_opens_the_door_and_imitation_does_not():
    found = recorded("adroit-door", natural=True, settings={"task": "staged"})
    rows = {row["method"]: row for row in natural_rows(found)}
    assert rows["npg-direct"]["good"] == rows["npg-direct"]["seeds"] == 5
    assert rows["npg-direct"]["median_iterations"] <= 131
    for name in ("npg-scratch", "dapg", "soil"):
        assert rows[name]["good"] == 0
        assert rows[name]["success"] < 0.05


@pytest.mark.parametrize(("robot", "text"), SECTIONS, ids=[name for name, _ in SECTIONS])
def test_the_page_of_results_says_what_is_recorded(robot, text):
    results, home = recorded(robot), load_expert(robot).card.episode_return
    rows = ROW.findall(text)
    assert {row[0] for row in rows} == set(results.methods)
    for method, *numbers in rows:
        scores = results.scores([method])[method]
        found = stats.interval(scores)
        told = [f"{x:.1f}" for x in (found.value, found.low, found.high)]
        assert numbers == [*told, str((scores > home / 2).sum()), str(len(scores))], method
    assert str(results.cost) in text
    for command in results.commands:
        assert command in text


def test_the_page_covers_every_recorded_robot():
    robots = {plan.robot for plan in PLANS if plan.learner is not None}
    assert {name for name, _ in SECTIONS} == robots
    assert len(FOLDERS) > 8


@pytest.mark.parametrize("name", ["cheetah-segment", "ball-in-cup-weak-motors"])
def test_the_new_pairs_are_solved_by_revolver_where_the_others_get_next_to_nothing(name):
    scores = recorded(name).scores(["scratch", "direct", "revolver"])
    assert scores["scratch"].mean() == 0
    assert scores["revolver"].mean() > 5 * scores["direct"].mean()
    better = stats.probability_of_improvement(scores["revolver"], scores["direct"])
    assert better.low > 0.5
