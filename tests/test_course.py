"""Lessons: the same rows in every mode, nothing trained unless asked, and clear refusals."""

import dataclasses
import importlib.util
import os

import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import MissingExtraError, SettingsError, UnknownNameError
from revolver_lab.files import write_json
from revolver_lab.lab import lessons
from revolver_lab.logs import write_table
from revolver_lab.methods import METHODS
from revolver_lab.runs import course, store
from revolver_lab.runs.lesson_plans import is_natural
from revolver_lab.runs.natural_summary import over_iterations
from revolver_lab.runs.plan import Plan
from revolver_lab.runs.results import LearnerResult, Results
from revolver_lab.stats import Cost

NAME = "04_deterministic_or_randomised"
every_lesson = pytest.mark.parametrize("name", course.LESSONS)
NATURAL = {name for name, each in course.LESSONS.items() if is_natural(each.methods)}
scheduled_lesson = pytest.mark.parametrize("name", [n for n in course.LESSONS if n not in NATURAL])
natural_lesson = pytest.mark.parametrize("name", sorted(NATURAL))


def _record(folder, methods, task, offset, expert=None):
    """A recorded run of three seeds whose learners return offset + seed."""
    robot = course.LESSONS[NAME].robots[0]
    plan = Plan(robot=robot, methods=methods, seeds=range(3), task=task, expert=expert)
    whose = [{"method": m.method.name, "seed": m.seed} for m in plan.members]
    nothing = {"evaluation_steps": 0, "wall_time": 1.0, "reached_target": True, "failure": ""}
    phase = {"phase": 0, "episodes": 8, "steps": 1600, "episode_return": 1.0, "kept": 0}
    home = folder / plan.name
    write_table(home / store.LEARNERS, [who | {"steps": 72_000} | nothing for who in whose])
    write_table(home / store.PHASES, [who | phase | {"alpha": 0.0} for who in whose])
    rows = [who | {"steps": steps, "alpha": 1.0, "returns": f"{offset + who['seed']} {offset}"}
            for who in whose for steps in (36_000, 72_000)]  # fmt: skip
    write_table(home / store.EVALUATIONS, rows)
    write_json(home / store.CONFIG, plan.to_json())
    write_json(home / store.CARD, {"command": plan.command, "expert_steps": 96_000,
                                   "processes": 2, "wall_time": 1.0})  # fmt: skip


@every_lesson
@pytest.mark.parametrize("mode", ["live", "fast"])
def test_every_lesson_has_a_plan_that_can_work(name, mode):
    lesson = course.lesson(name, mode)
    plan = lesson.plan
    assert tuple(m.name for m in plan.methods) == lesson.methods
    assert plan.robot == lesson.robots[0]
    assert len(plan.members) <= 25  # under four minutes on two cores
    most = {"fast": 5_000, "live": 800_000 if name in NATURAL else 72_000}
    assert plan.steps <= most[mode]
    assert lesson.run.status().state == "new"
    assert ("--plan" in plan.command) == (mode == "fast" or plan.evaluate_every not in (0, 24_000))


@scheduled_lesson
def test_live_trains_the_very_methods_that_were_recorded(name):
    lesson = course.lesson(name, "live")
    plan = Plan(robot=lesson.robots[0], methods=lesson.methods, seeds=range(10))
    assert dataclasses.replace(lesson.plan, seeds=plan.seeds, evaluate_every=24_000) == plan


@natural_lesson
def test_live_and_fast_train_the_natural_methods_that_were_recorded(name):
    robot, methods = course.LESSONS[name].robots[0], course.LESSONS[name].methods
    recorded = Plan(robot=robot, methods=methods, seeds=[0]).methods
    for mode, changed in (("live", set()), ("fast", {"trajectories", "length", "warm_batches"})):
        for row, whole in zip(course.lesson(name, mode).plan.methods, recorded, strict=True):
            same = {field: getattr(whole.settings, field) for field in changed}
            assert dataclasses.replace(row, settings=dataclasses.replace(row.settings, **same)) == (
                whole)  # fmt: skip


@scheduled_lesson
def test_fast_changes_the_path_and_nothing_else(name):
    lesson = course.lesson(name, "fast")
    path = {"alpha_step", "xi", "episodes_per_phase", "final_episodes", "window"}
    for short in lesson.plan.methods:
        whole = METHODS[short.name]
        for field in dataclasses.fields(whole):
            if field.name != "schedule":
                assert getattr(short, field.name) == getattr(whole, field.name)
        for field in dataclasses.fields(whole.schedule):
            if field.name not in path:
                given = getattr(short.schedule, field.name)
                assert given == getattr(whole.schedule, field.name), field.name
        assert (short.schedule.xi == 0) == (whole.schedule.xi == 0)
        assert (short.schedule.window is None) == (whole.schedule.window is None)
        assert {*short.schedule.alphas} <= {0.0, 0.5, 1.0}


def test_nothing_is_trained_unless_asked(tmp_path, monkeypatch):
    monkeypatch.delenv(course.MODE, raising=False)
    monkeypatch.chdir(tmp_path)
    lesson = rvl.lab.lesson(NAME)
    assert lesson.mode == "recorded"
    assert lesson.plan is None
    assert lesson.run is None
    assert "nothing is trained here" in str(lesson)
    assert f'rvl.lab.lesson("{NAME}", "live")' in str(lesson)
    assert not os.listdir(tmp_path)


def test_the_environment_chooses_the_mode_and_the_notebook_overrules_it(monkeypatch):
    monkeypatch.setenv(course.MODE, "fast")
    assert rvl.lab.lesson(NAME).mode == "fast"
    assert rvl.lab.lesson(NAME, "recorded").mode == "recorded"
    monkeypatch.setenv(course.MODE, "")
    assert rvl.lab.lesson(NAME).mode == "recorded"


def test_an_unknown_lesson_lists_near_ones():
    with pytest.raises(UnknownNameError, match="Did you mean '04_deterministic_or_randomised'"):
        rvl.lab.lesson("04_deterministic")


def test_an_unknown_mode_names_where_it_came_from(monkeypatch):
    with pytest.raises(SettingsError, match=r"mode = 'alive'.*recorded"):
        rvl.lab.lesson(NAME, "alive")
    monkeypatch.setenv(course.MODE, "quick")
    with pytest.raises(SettingsError, match="REVOLVER_LAB_MODE = 'quick'"):
        rvl.lab.lesson(NAME)


def test_without_torch_one_can_read_but_not_train(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert rvl.lab.lesson(NAME, "recorded").run is None
    for mode in ("live", "fast"):
        with pytest.raises(MissingExtraError, match=r"pip install 'revolver-lab\[train\]'"):
            rvl.lab.lesson(NAME, mode)
        for name in NATURAL:  # numpy is enough
            assert rvl.lab.lesson(name, mode).run is not None


def test_recorded_rows_come_in_the_lessons_order_and_of_the_asked_reward(tmp_path):
    rows = course.LESSONS[NAME].methods
    _record(tmp_path, rows[::-1], None, 100)
    _record(tmp_path, rows, "dense", 0)
    for mode in ("recorded", "live"):
        lesson = course.lesson(NAME, mode, folder=tmp_path)
        assert lesson.recorded().methods == rows
        np.testing.assert_allclose(lesson.recorded().scores()["revolver"], [100, 100.5, 101])
    dense = lesson.recorded(methods=["revolver"], task="dense")
    np.testing.assert_allclose(dense.scores()["revolver"], [0, 0.5, 1])
    with pytest.raises(SettingsError, match="'scratch'"):
        lesson.recorded(methods=["scratch"])


def test_runs_with_another_expert_are_kept_apart(tmp_path):
    rows = course.LESSONS[NAME].methods
    _record(tmp_path, rows, None, 100)
    _record(tmp_path, rows, None, 7, expert=course.OTHER_EXPERT)
    lesson = course.lesson(NAME, "recorded", folder=tmp_path)
    np.testing.assert_allclose(lesson.recorded().scores()["revolver"], [100, 100.5, 101])
    other = lesson.recorded(expert=course.OTHER_EXPERT)
    np.testing.assert_allclose(other.scores()["revolver"], [7, 7.5, 8])


def test_a_recorded_lesson_is_drawn_with_its_seeds_and_its_cost(tmp_path):
    _record(tmp_path, course.LESSONS[NAME].methods, None, 10)
    shown = lessons.Lesson(name=NAME, mode="recorded", folder=tmp_path).watch()
    assert isinstance(shown, rvl.lab.Drawing)
    assert "3 seeds" in shown.alt
    assert "96 k for the expert" in shown.alt
    assert "deterministic-equal ends at 10.5" in shown.alt


def test_a_lesson_that_trains_is_watched(monkeypatch):
    seen = []
    monkeypatch.setattr(lessons, "watch", seen.append)
    lesson = rvl.lab.lesson(NAME, "live")
    lesson.watch()
    assert seen == [lesson.run]
    assert seen[0].plan == lesson.plan


@pytest.mark.slow
def test_fast_trains_every_row_with_two_seeds_and_leaves_nothing_behind():
    lesson = course.lesson("02_why_direct_transfer_fails", "fast")
    results = lesson.results()
    assert results.methods == lesson.methods
    assert all(results.seeds(name) == (0, 1) for name in results.methods)
    assert all(0 < one.cost.steps <= 4800 for one in results.learners)
    assert not any(one.failure for one in results.learners)
    folder = lesson.run.folder
    assert folder.exists()
    del lesson
    assert not folder.exists()


def test_numbers_of_iterations_are_as_long_as_the_longest_learners():
    def learner(seed, alphas):
        return LearnerResult(
            method="npg-revolver", seed=seed, returns=np.ones(1), steps=np.ones(1),
            curve=np.ones(1), phases=(), cost=Cost(steps=1, seconds=1.0), failure="",
            folder=course.ROOT,
            iterations=tuple({"iteration": i, "alpha": a} for i, a in enumerate(alphas)),
        )  # fmt: skip

    found = Results(robot="x", learners=(learner(1, [0.0, 0.5, 1.0]), learner(0, [0.2])),
                    expert_steps=0, commands=())  # fmt: skip
    table = over_iterations(found, "alpha")["npg-revolver"]
    assert table.tolist() == [[0.2, 0.2, 0.2], [0.0, 0.5, 1.0]]
