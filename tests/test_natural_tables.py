"""Tables of natural methods: who broke down never got there, and the words of both are the same."""

from pathlib import Path

import numpy as np
import pytest

from revolver_lab.runs.markdown import markdown
from revolver_lab.runs.natural_summary import natural_rows
from revolver_lab.runs.results import LearnerResult, Results
from revolver_lab.runs.summary import describe
from revolver_lab.stats import Cost

BROKEN = "its numbers are no longer finite"


def learner(seed, iterations, finished, failure=""):
    made = tuple({"iteration": float(i), "alpha": 1.0} for i in range(iterations))
    return LearnerResult(
        method="m", seed=seed, returns=np.ones(10), steps=np.array([iterations]), curve=np.ones(1),
        phases=({"alpha": 1.0},), cost=Cost(steps=iterations, seconds=1.0), failure=failure,
        folder=Path(), successes=np.full(10, finished), iterations=made, finished=finished,
    )  # fmt: skip


def results(*some):
    """Results of (iterations, whether the gate was content, failure), seed by seed."""
    learners = tuple(learner(seed, *one) for seed, one in enumerate(some))
    return Results(robot="r", learners=learners, expert_steps=0, commands=("train",))


def slow_median(some):
    """The middle of the times, those who never got there at infinity."""
    times = sorted(iterations if content else np.inf for iterations, content, *_ in some)
    return times[(len(times) + 1) // 2 - 1]


@pytest.mark.parametrize(
    "some",
    [
        [(100, True)] * 2 + [(5, False, BROKEN)] * 3,
        [(100, True)] * 3 + [(5, False, BROKEN)] * 2,
        [(30, True), (70, True), (90, True), (1, False, BROKEN), (2, False, BROKEN)],
        [(30, True), (5, False, BROKEN), (200, False)],
        [(5, False, BROKEN), (7, False, BROKEN)],
        [(40, True), (50, True, BROKEN)],  # broke as it got there: it did get there
    ],
)
def test_a_learner_that_broke_down_is_one_that_never_gets_there(some):
    row = natural_rows(results(*some))[0]
    assert row["median_iterations"] == slow_median(some)
    watched = max(iterations for iterations, *_ in some)
    assert row["censored_at"] == (None if all(one[1] for one in some) else watched)


def test_a_table_says_that_most_learners_broke_down():
    told = results(*[(100, True)] * 2, *[(5, False, BROKEN)] * 3)
    for words in (describe(told), markdown(told)):
        assert "not in 100" in words
        assert "not in 5" not in words


@pytest.mark.parametrize(
    ("some", "words"),
    [
        ([(100, True)] * 3 + [(200, False)] * 2, "100; 2 not in 200"),
        ([(100, True)] * 3, "100"),
        ([(100, True), (200, False)], "100; 1 not in 200"),
        ([(100, True)] + [(200, False)] * 2, "not in 200"),
        ([(100, True)] * 3 + [(9, False, BROKEN)], "100; 1 not in 100"),
    ],
)
def test_text_and_markdown_tell_of_those_that_did_not_get_there_in_the_same_words(some, words):
    told = results(*some)
    row = next(line for line in markdown(told).splitlines() if line.startswith("| m |"))
    assert row.split(" | ")[4] == words
    line = next(line for line in describe(told).splitlines() if line.startswith("m "))
    assert line.endswith(f"  {words}")
