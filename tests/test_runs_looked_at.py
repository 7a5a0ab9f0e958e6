"""Looking at a run changes nothing, and what somebody else does meanwhile is no other state."""

import json
import os
import shutil

import pytest
from small_runs import tiny_plan

from revolver_lab.files import asset_folder
from revolver_lab.runs import Run, store
from revolver_lab.runs import run as running
from revolver_lab.runs.claim import claimed, is_claimed


@pytest.fixture
def finished(tmp_path):
    """A recorded run as it was just before its end: a shard is done, and nobody has collected."""
    (shipped,) = asset_folder("results").glob("cheetah-front-leg-7eae12930680")
    run = Run.open(shutil.copytree(shipped, tmp_path / shipped.name))
    card = (run.folder / store.CARD).read_bytes()

    def back():
        (run.folder / store.CARD).unlink(missing_ok=True)
        store.shard_folder(run.folder, 0).mkdir(parents=True, exist_ok=True)
        (run.folder / store.SHARDS).write_text(json.dumps({"shards": 1}))

    def collected():
        (run.folder / store.CARD).write_bytes(card)
        shutil.rmtree(run.folder / store.WORK, ignore_errors=True)

    back()
    return run, collected


@pytest.mark.parametrize("name", ["count_shards", "shard_folder", "read_json"])
def test_collected_by_somebody_else_between_two_looks_it_is_finished(finished, name, monkeypatch):
    run, collected = finished
    real, looks = getattr(store, name), []

    def look(*given):
        looks.append(given)
        collected()
        return real(*given)

    monkeypatch.setattr(store, name, look)
    assert run.status().state == "finished"
    assert looks


def test_collected_while_progress_is_read_it_is_finished(finished, monkeypatch):
    run, collected = finished
    monkeypatch.setattr(running, "read", lambda *_: collected() or ((), {}))
    assert run.status().state == "finished"


def snapshot(folder):
    return {str(path): os.stat(path).st_mtime_ns for path in [folder, *folder.rglob("*")]}


def test_looking_at_an_unfinished_run_writes_nothing(tmp_path, monkeypatch):
    run = Run(tiny_plan(), root=tmp_path)
    run.prepare(2)
    before = snapshot(run.folder)
    assert run.status().state == "stopped"
    assert snapshot(run.folder) == before
    shard = store.shard_folder(run.folder, 1)
    with claimed(shard):
        before = snapshot(run.folder)
        assert run.status().state == "running"
        assert snapshot(run.folder) == before
    assert run.status().state == "stopped"
    assert snapshot(run.folder) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="whoever is root may write anywhere")
def test_an_unfinished_run_in_a_folder_that_is_read_only_can_be_looked_at(tmp_path):
    run = Run(tiny_plan(), root=tmp_path)
    run.prepare(1)
    folders = [run.folder, run.folder / store.WORK, store.shard_folder(run.folder, 0)]
    for folder in folders:
        folder.chmod(0o555)
    try:
        assert run.status().state == "stopped"
    finally:
        for folder in folders:
            folder.chmod(0o755)


def test_two_who_look_at_once_do_not_take_each_other_for_a_worker(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    with claimed(tmp_path):
        assert is_claimed(tmp_path)
    with open(tmp_path / store.LOCK) as other:
        fcntl.flock(other, fcntl.LOCK_SH)
        assert not is_claimed(tmp_path)
