"""What is there already is replaced as a whole or stays: kept runs, saved logs, and no room."""

import errno
import json
import os
import shutil

import pytest

import revolver_lab as rvl
from revolver_lab import cli
from revolver_lab.errors import PolicyFileError
from revolver_lab.files import asset_folder
from revolver_lab.gates import SampledGate
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.natural_transfer import natural_transfer
from revolver_lab.policies import Policy
from revolver_lab.runs import Run, keep, keeping, store
from revolver_lab.trajectories import Success

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


def natural(seed):
    settings = NaturalSettings(trajectories=2, length=10, warm_batches=0, value_hidden=(8,))
    return natural_transfer(
        None, "cheetah-front-leg", SampledGate(), settings=settings, steps=40, seed=seed,
        success=Success(least_return=1.0), evaluate_episodes=0, nthread=1,
    )  # fmt: skip


def test_a_log_is_never_of_another_transfer_than_the_policy_beside_it(tmp_path, monkeypatch):
    old, new, synced = natural(1), natural(2), os.fsync
    for room in range(5):
        old.save(tmp_path)
        left = iter(range(room))

        def fsync(handle, left=left):
            if next(left, None) is None:
                raise OSError(errno.ENOSPC, "No space left on device")
            synced(handle)

        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", fsync)
            with pytest.raises(OSError, match="No space left"):
                new.save(tmp_path)
        assert not (tmp_path / "log.json").exists()
    new.save(tmp_path)
    assert json.loads((tmp_path / "log.json").read_text())["seed"] == 2
    assert Policy.load(tmp_path / "policy.safetensors").card.seed == 2
    assert (tmp_path / "iterations.csv").read_text().count("\n") == 1 + len(new.iterations)


def test_a_transfer_saved_over_a_natural_one_leaves_no_iterations(tmp_path):
    natural(1).save(tmp_path)
    schedule = rvl.Schedule(alpha_start=1.0, xi=0.0, final_episodes=8)
    rvl.transfer(None, "cheetah-front-leg", schedule, evaluate_episodes=0, out=tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        "log.json", "phases.csv", "policy.safetensors", "policy.json"}  # fmt: skip
