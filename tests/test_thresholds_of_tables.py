"""One threshold, one comparison: text, Markdown and CSV agree on who succeeded, and say how."""

import csv
from pathlib import Path

import numpy as np
import pytest

from revolver_lab import cli
from revolver_lab.errors import SettingsError
from revolver_lab.runs.markdown import markdown
from revolver_lab.runs.natural_summary import is_natural
from revolver_lab.runs.recordings import recorded_kinds
from revolver_lab.runs.results import LearnerResult, Results
from revolver_lab.runs.summary import describe, rows
from revolver_lab.stats import Cost

RETURNS = (10.0, 79.9, 80.0, 80.1, 90.0)


def results(home=160.0):
    learners = tuple(
        LearnerResult(method="m", seed=seed, returns=np.full(3, value), steps=np.array([1]),
                      curve=np.array([value]), phases=({"alpha": 1.0},), failure="", folder=Path(),
                      cost=Cost(steps=1, seconds=1.0))
        for seed, value in enumerate(RETURNS)
    )  # fmt: skip
    return Results(robot="r", learners=learners, expert_steps=0, commands=("train",),
                   expert_return=home)  # fmt: skip


@pytest.mark.parametrize("threshold", [None, 80.0, 80, np.float64(79.9), 0.0, -1.0, 91.0])
def test_who_returns_the_threshold_itself_succeeds_in_every_table(threshold):
    least = 80.0 if threshold is None else threshold
    expected = sum(value >= least for value in RETURNS)
    told = results()
    assert rows(told, threshold)[0]["success"] == expected / 5
    assert f"{expected / 5:.0%}" in describe(told, threshold)
    assert f"a mean return of {least:.4g} or more" in describe(told, threshold)
    page = markdown(told, threshold).splitlines()
    named = "half of home" if threshold is None else f"{least:.4g}"
    assert page[0].endswith(f"| {named} or more |")
    assert page[2].endswith(f"| {expected} of 5 |")


def test_where_nobody_knows_what_a_success_is_no_table_counts_any():
    told = results(home=None)
    assert rows(told)[0]["success"] is None
    assert markdown(told).splitlines()[2].endswith("| - |")


@pytest.mark.parametrize("threshold", [np.nan, np.inf, -np.inf, "80", True, [80.0]])
@pytest.mark.parametrize("table", [rows, describe, markdown])
def test_a_threshold_that_is_no_finite_number_is_refused_for_whatever_methods(threshold, table):
    natural = recorded_kinds("adroit-door-fingers")[0][1]
    for some in (results(), natural):
        with pytest.raises(SettingsError, match="threshold = "):
            table(some, threshold)


@pytest.mark.parametrize("words", [[], ["--markdown"]])
@pytest.mark.parametrize("threshold", ["nan", "inf"])
def test_a_report_refuses_it_before_it_says_anything(words, threshold, capsys):
    assert cli.main(["report", "cheetah-front-leg", "--threshold", threshold, *words]) == 2
    said = capsys.readouterr()
    assert f"threshold = {threshold}. Allowed: a finite number" in said.err
    assert not said.out


@pytest.mark.parametrize("words", [[], ["--markdown"]])
def test_a_report_heeds_a_threshold_or_says_that_it_does_not_apply(words, capsys, tmp_path):
    asked = ["report", "cheetah-front-leg", "--threshold", "120", *words]
    assert cli.main([*asked, "--csv", str(tmp_path / "a.csv")]) == 0
    said = capsys.readouterr()
    assert "120 or more" in said.out
    titles = [f"cheetah-front-leg: {name}" for name, some in recorded_kinds("cheetah-front-leg")
              if is_natural(some)]  # fmt: skip
    assert said.err.count("does not apply") == len(titles) == 1
    assert titles[0] in said.err
    table = [*csv.DictReader((tmp_path / "a.csv").open())]
    assert {row["threshold"] for row in table if row.get("threshold")} == {"120.0"}
    assert cli.main(["report", "adroit-door-fingers", "--threshold", "120", *words]) == 0
    said = capsys.readouterr()
    assert "--threshold does not apply to adroit-door-fingers" in said.err
    assert "120 or more" not in said.out
