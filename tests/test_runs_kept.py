"""What is there already is replaced as a whole or stays: kept runs, saved logs, and no room."""

import os
import shutil

import pytest

from revolver_lab import cli
from revolver_lab.errors import PolicyFileError
from revolver_lab.files import asset_folder
from revolver_lab.runs import Run, keep, keeping, store

NATURAL = "adroit-door-fingers-87c20ef7e340"


@pytest.fixture
def run(tmp_path):
    return shutil.copytree(asset_folder("results") / NATURAL, tmp_path / "runs" / NATURAL)


def held(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def tables(folder):
    return {path.name: path.read_bytes() for path in folder.glob("*.csv")}


def test_a_run_whose_policies_are_gone_does_not_replace_a_kept_one(run, tmp_path):
    kept = keep(run, tmp_path / "kept")
    before = held(kept)
    shutil.rmtree(run / store.POLICIES)
    with pytest.raises(PolicyFileError, match="not kept"):
        keep(run, tmp_path / "kept")
    assert held(kept) == before
    assert [path.name for path in kept.parent.iterdir()] == [kept.name]


@pytest.mark.parametrize("thinned", [False, True])
def test_kept_again_and_interrupted_at_any_rename_the_copy_is_the_old_one_or_the_new(
    run, tmp_path, monkeypatch, thinned
):
    kept, renamed = keep(run, tmp_path / "kept"), os.replace
    if thinned:
        monkeypatch.setattr(keeping, "_MOST_ROWS", 3)
    new = tables(keep(run, tmp_path / "other"))
    for survivors in range(100):
        left = iter(range(survivors))

        def replace(source, target, left=left):
            if next(left, None) is None:
                monkeypatch.setattr(os, "replace", renamed)
                raise KeyboardInterrupt
            renamed(source, target)

        before = held(kept)
        monkeypatch.setattr(os, "replace", replace)
        try:
            keep(run, tmp_path / "kept")
            break
        except KeyboardInterrupt:
            pass
        assert held(kept) == before
        Run.open(kept).results()
    assert survivors > 8
    assert tables(kept) == new
    assert {*held(kept)} == {*before}
    assert [path.name for path in kept.parent.iterdir()] == [kept.name]
    assert (kept.stat().st_mode & 0o777) == (run.stat().st_mode & 0o777)


def test_a_natural_learner_that_could_not_be_saved_is_not_trained(tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    words = ["transfer", "adroit-door", "--method", "npg-direct", "--steps", "1"]
    assert cli.main([*words, "-o", str(tmp_path / "file" / "out")]) == 2
    said = capsys.readouterr()
    assert "nothing can be written" in said.err
    assert "iteration" not in said.err + said.out
