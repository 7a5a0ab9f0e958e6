"""Files of runs that were torn, altered or made up: refused in one line, and nothing is touched."""

import json
import shutil

import pytest

from revolver_lab import cli
from revolver_lab.errors import SettingsError
from revolver_lab.files import asset_folder
from revolver_lab.runs import store
from revolver_lab.runs.results import read_results

TABLES = (store.LEARNERS, store.PHASES, store.EVALUATIONS)


@pytest.fixture
def run(tmp_path):
    """A copy of a recorded run of the cheetah, two levels below what might be a victim."""
    (shipped,) = asset_folder("results").glob("cheetah-front-leg-7eae12930680")
    return shutil.copytree(shipped, tmp_path / "runs" / shipped.name)


def change_card(run, **changes):
    """Alters a card; where a table has no digest in it, nobody notices that it was altered."""
    path = run / store.CARD
    path.write_text(json.dumps(json.loads(path.read_text()) | {"digests": {}} | changes))


def renamed(run, new):
    """Lets a learner's table speak of another method."""
    change_card(run)
    name = store.read_plan(run).methods[0].name
    for table in (run / name for name in TABLES):
        table.write_text(table.read_text().replace(f"\n{name},", f"\n{new},"))


@pytest.mark.parametrize("name", ["../../victim", "/etc", "another", ""])
def test_a_learner_that_nobody_planned_is_refused_and_its_name_is_no_path(run, name, capsys):
    precious = run.parent / "victim" / "0" / "precious.txt"
    precious.parent.mkdir(parents=True)
    precious.write_text("kept")
    renamed(run, name)
    with pytest.raises(SettingsError, match="each learner of the plan, once"):
        read_results(run)
    for words in (["tensorboard", str(run), "-o", str(run / "a" / "b")], ["report", str(run)],
                  ["keep", str(run), "-o", str(run / "kept")]):  # fmt: skip
        assert cli.main(words) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert precious.read_text() == "kept"
    assert not (run / "a").exists()
    assert not (run / "kept").exists()


def test_a_learner_twice_in_the_tables_is_refused_and_one_that_lacks_as_well(run):
    change_card(run)
    table = run / store.LEARNERS
    lines = table.read_text().splitlines(keepends=True)
    for wrong in ([*lines, lines[-1]], lines[:-1], [*lines[:-1], lines[-2]]):
        table.write_text("".join(wrong))
        with pytest.raises(SettingsError, match="each learner of the plan, once"):
            read_results(run)


def test_event_files_are_written_anew_and_what_lies_beside_them_stays(run, tmp_path):
    name = store.read_plan(run).methods[0].name
    elsewhere, out = tmp_path / "elsewhere", tmp_path / "out"
    (elsewhere / "0").mkdir(parents=True)
    (elsewhere / "0" / "precious.txt").write_text("kept")
    out.mkdir()
    (out / name).symlink_to(elsewhere)  # as an archive may bring it
    for _ in range(2):
        assert cli.main(["tensorboard", str(run), "-o", str(out)]) == 0
    assert (elsewhere / "0" / "precious.txt").read_text() == "kept"
    assert len(list((elsewhere / "0").glob("events.*"))) == 1


def test_a_natural_run_without_its_iterations_is_torn(tmp_path, capsys):
    shipped = asset_folder("results") / "adroit-door-fingers-87c20ef7e340"
    run = shutil.copytree(shipped, tmp_path / shipped.name)
    (run / store.ITERATIONS).unlink()
    for altered in (False, True):
        if altered:
            change_card(run)  # nothing says what there was
        assert cli.main(["report", str(run)]) == 2
        assert "iterations.csv, which cannot be read" in capsys.readouterr().err
