"""Every exercise of every notebook: right is praised, wrong is told why, nothing ends in a fail."""

import re
from pathlib import Path

import numpy as np
import pytest
import test_exercises
import test_exercises_course
import test_exercises_hand
import test_exercises_limbs

from revolver_lab.exercises import five_fingers_to_two, limbs_that_grow, points_on_a_path

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"
ANSWERS = {module: (test_exercises_course.RIGHT[module], test_exercises_course.WRONG[module])
           for module in test_exercises_course.MODULES} | {
    points_on_a_path: (test_exercises.RIGHT, test_exercises.WRONG),
    limbs_that_grow: (test_exercises_limbs.RIGHT, test_exercises_limbs.WRONG),
    five_fingers_to_two: (test_exercises_hand.RIGHT, test_exercises_hand.WRONG),
}  # fmt: skip
EXERCISES = [(module, name) for module, (right, _) in ANSWERS.items() for name in right]
every_exercise = pytest.mark.parametrize(
    ("module", "name"), EXERCISES, ids=lambda x: getattr(x, "__name__", x).split(".")[-1]
)

JUNK = ["text", 3, [], {}, object(), print, lambda: 0, lambda a: object(), lambda a: "x"]
JUNK += [lambda a: [[]], lambda a: (None, None), lambda a: 1j, lambda a: [1, [2, 3]], lambda a: {}]
JUNK += [{1, "x"}, ("a", "b"), ("a", "b", "c", "d"), ([], {}, None), [[1, 2], 3], True, np.nan]
JUNK += [b"x", lambda *a: [1, [2, 3]], lambda *a: np.nan, lambda *a: {}, lambda *a: a,
         lambda *a: "x", {"actor": 1}]  # fmt: skip
JUNK += [np.array(3.0), np.array([]), lambda *a: 20**999, 20**999, lambda *a: Unreadable()]


class Unreadable:
    def __array__(self, *args, **kwargs):
        raise RuntimeError("no numbers here")


def test_every_module_of_exercises_is_here_with_right_and_wrong_answers_to_all():
    folder = Path(points_on_a_path.__file__).parent
    shared = {"__init__", "recognising", "verdict"}
    files = {path.stem for path in folder.glob("*.py")} - shared
    assert files == {module.__name__.split(".")[-1] for module in ANSWERS}
    for module, (right, wrong) in ANSWERS.items():
        assert set(right) == set(wrong) == {"one", "two", "three"}
        assert set(getattr(module, "TEXTS", right)) == set(right)  # the first notebook has its own


@every_exercise
def test_right_answers_are_praised(module, name):
    for answer in ANSWERS[module][0][name]:
        found = getattr(module, name)(answer)
        assert found.right, found
        assert repr(found).startswith("Right.")


@every_exercise
def test_wrong_answers_are_told_their_misconception(module, name):
    assert len(ANSWERS[module][1][name]) >= 3
    for answer, words in ANSWERS[module][1][name]:
        found = getattr(module, name)(answer)
        assert found.state == "wrong", words
        assert re.search(words, found.message), (words, found.message)


@every_exercise
def test_no_answer_whatever_ends_in_a_traceback(module, name):
    for junk in JUNK:
        found = getattr(module, name)(junk)
        assert found.state == "wrong", junk
        assert len(found.message) > 20


@every_exercise
@pytest.mark.parametrize("nothing", [..., None])
def test_an_unanswered_exercise_says_so(module, name, nothing):
    found = getattr(module, name)(nothing)
    assert found.state == "open"
    assert "Not answered yet" in repr(found)


@every_exercise
def test_every_exercise_has_its_text_and_the_text_does_not_hold_the_praise(module, name):
    if not hasattr(module, "TEXTS"):
        pytest.skip("its text stands in the notebook")
    text = module.TEXTS[name]
    assert 60 < len(text) < 900
    assert "$" not in text
    assert getattr(module, name)(ANSWERS[module][0][name][0]).message not in text


@every_exercise
def test_the_notebook_asks_it(module, name):
    short = module.__name__.split(".")[-1]
    (notebook,) = NOTEBOOKS.glob(f"*_{short}.py")
    text = re.sub(r"\s*\n# ", " ", notebook.read_text())
    assert f"from revolver_lab.exercises import {short} as checks" in text
    assert f"checks.{name}(" in text
