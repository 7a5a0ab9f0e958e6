"""Runs: refused before they begin, found again, stopped, resumed, torn, and reported."""

import dataclasses
import errno
import json
import os
import shutil
import signal
import time

import numpy as np
import pytest
from small_runs import EAGER, ROBOT, TINY_RUN, files_of, tiny_plan
from stable_baselines3 import SAC

from revolver_lab import preflight
from revolver_lab.errors import PolicyFileError, RevolverError, SettingsError, UnknownNameError
from revolver_lab.experts import load_expert
from revolver_lab.learners.settings import COURSE
from revolver_lab.runs import Plan, Run, checkpoint, keep, recorded, store, summary
from revolver_lab.runs.claim import ShardTakenError, claimed, is_claimed
from revolver_lab.runs.so_far import so_far
from revolver_lab.runs.worker import STOPPED, Worker, train
from revolver_lab.runs.worker import main as work
from revolver_lab.schedule import Schedule


def schedule(**changes):
    return dataclasses.replace(TINY_RUN, schedule=dataclasses.replace(TINY_RUN.schedule, **changes))


REFUSED = [
    ({"methods": [schedule(episodes_per_phase=4)]}, "shorter than an episode"),
    ({"steps": 3199}, "steps = 3199"),
    ({"steps": True}, "steps = True"),
    ({"steps": 4800.5}, "steps = 4800.5"),
    ({"steps": "4800"}, "steps = '4800'"),
    ({"seeds": []}, "one or more"),
    ({"seeds": [0, -1]}, "seeds = [0, -1]"),
    ({"seeds": "12"}, "seeds = '12'"),
    ({"seeds": [1.5]}, "seeds = [1.5]"),
    ({"seeds": [True]}, "seeds = [True]"),
    ({"seeds": [0, 0]}, "a name of its own"),
    ({"seeds": 3}, "seeds = 3"),
    ({"methods": []}, "one or more"),
    ({"methods": "direct"}, "methods = 'direct'"),
    ({"methods": [TINY_RUN.schedule]}, "a list of names and Methods"),
    ({"methods": [TINY_RUN, schedule(xi=0.7)]}, "several methods named ['tiny']"),
    ({"methods": [TINY_RUN, dataclasses.replace(TINY_RUN, name="TINY")]}, "several methods"),
    ({"methods": [dataclasses.replace(TINY_RUN, name="../tiny")]}, "the name of a method"),
    ({"methods": [dataclasses.replace(TINY_RUN, name="a/b")]}, "the name of a method"),
    ({"methods": [dataclasses.replace(TINY_RUN, name="")]}, "the name of a method"),
    ({"methods": [dataclasses.replace(TINY_RUN, name="a,b")]}, "the name of a method"),
    ({"methods": [schedule(xi=np.float32(0.7))]}, "JSON cannot hold"),
    ({"evaluate_every": -1}, "evaluate_every = -1"),
    ({"evaluate_every": 2.0}, "evaluate_every = 2.0"),
    ({"evaluate_episodes": 0}, "evaluate_episodes = 0"),
    ({"learner": {"algorithm": "SAC"}}, "LearnerSettings"),
    ({"learner": dataclasses.replace(COURSE, algorithm=SAC)}, "only they can be resumed"),
    ({"learner": dataclasses.replace(COURSE, options={"seed": 1})}, "only they can be resumed"),
    ({"learner": dataclasses.replace(COURSE, algorithm="DDPG")}, "only they can be resumed"),
    ({"robot": 3}, "robot = 3"),
    ({"task": 3}, "task = 3"),
    ({"expert": b"1"}, "expert = b'1'"),
]


@pytest.mark.parametrize(("change", "text"), REFUSED, ids=[text for _, text in REFUSED])
def test_a_plan_that_cannot_work_is_refused_with_the_remedy(change, text):
    with pytest.raises(SettingsError) as caught:
        tiny_plan(**change)
    assert text in str(caught.value)
    assert caught.value.remedy.endswith((".", "?"))


@pytest.mark.parametrize(
    ("change", "near"),
    [({"methods": ["revolvr"]}, "'revolver'"), ({"robot": "cheetah-frontleg"}, ROBOT),
     ({"task": "spars"}, "'sparse'")],
)  # fmt: skip
def test_an_unknown_name_lists_the_near_ones(change, near):
    with pytest.raises(UnknownNameError, match=f"Did you mean.*{near}"):
        tiny_plan(**change)


@pytest.mark.parametrize(
    "change",
    [{"xi": 0.4}, {"xi": 1.5}, {"xi": "0.6"}, {"alpha_step": 0}, {"alpha_step": 1.1},
     {"alpha_step": float("nan")}, {"xi": float("nan")}, {"final_episodes": "8"}],
    ids=str,
)  # fmt: skip
def test_xi_and_the_step_of_alpha_outside_their_range_are_refused(change):
    with pytest.raises(SettingsError, match=next(iter(change))):
        schedule(**change)


def test_more_memory_than_the_machine_has_is_refused_and_what_fits_is_said(tmp_path, monkeypatch):
    plan = tiny_plan(seeds=range(50))
    row = preflight.replay_bytes(1, 1, 18, 6)

    class Memory:
        available = 10 * 3208 * row / 0.8

    monkeypatch.setattr("psutil.virtual_memory", lambda: Memory)
    with pytest.raises(SettingsError, match="train 10 learners at a time") as caught:
        Run(plan, root=tmp_path).start()
    assert "buffer_size=641" in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_an_expert_of_another_shape_or_another_hash_is_refused_before_anything(tmp_path):
    other = load_expert(ROBOT).without_critic().lifted(range(18), 20, range(6), 6)
    from revolver_lab.weights import digest

    with pytest.raises(PolicyFileError, match="20 observations"):
        Run(tiny_plan(expert=digest(other.weights)), root=tmp_path, expert=other).start()
    with pytest.raises(SettingsError, match="an expert of other weights"):
        Run(tiny_plan(), root=tmp_path, expert=other).start()
    assert not list(tmp_path.iterdir())


def test_the_same_plan_has_the_same_name_and_another_another():
    plan = tiny_plan()
    assert plan.name == Plan.from_json(json.loads(json.dumps(plan.to_json()))).name
    assert plan.name == tiny_plan(seeds=range(2), steps=np.int64(3200)).name
    others = [{"seeds": [0, 2]}, {"steps": 3201}, {"evaluate_every": 0}, {"task": "dense"},
              {"learner": dataclasses.replace(EAGER, tau=0.02)}, {"methods": [schedule(xi=0.7)]},
              {"expert": "0" * 64}]  # fmt: skip
    assert len({plan.name, *(tiny_plan(**change).name for change in others)}) == 1 + len(others)


@pytest.mark.parametrize(
    ("damage", "text"),
    [
        (lambda c: c | {"format": 99}, "format 99"),
        (lambda c: {k: v for k, v in c.items() if k != "seeds"}, "format 1"),
        (lambda c: c | {"more": 1}, "another version"),
        (lambda c: [], "another version"),
        (lambda c: c | {"methods": [{"name": "a"}]}, "cannot be read"),
        (lambda c: c | {"methods": 5}, "cannot be read"),
        (lambda c: c | {"learner": {"hidden": [8], "magic": 1}}, "cannot be read"),
    ],
)
def test_a_folder_of_another_version_is_refused(tmp_path, damage, text):
    run = Run(tiny_plan(), root=tmp_path)
    run.folder.mkdir()
    (run.folder / store.CONFIG).write_text(json.dumps(damage(tiny_plan().to_json())))
    for opened in (lambda: Run(tiny_plan(), root=tmp_path), lambda: Run.open(run.folder)):
        with pytest.raises(SettingsError, match=text):
            opened()


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(SettingsError, match="cannot be read"):
        Run.open(tmp_path)


def prepared(tmp_path, processes=1, **changes):
    """A run that is ready, and no worker at it."""
    run = Run(tiny_plan(**changes), root=tmp_path)
    run.prepare(processes)
    return run


def trained(tmp_path, processes=1, **changes):
    """A run whose shards are trained here, one after the other."""
    run = prepared(tmp_path, processes, **changes)
    for shard in range(processes):
        assert work([str(run.folder), str(shard)]) == 0
    return run


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return trained(tmp_path_factory.mktemp("finished"))


@pytest.fixture
def copied(finished, tmp_path):
    finished.results()
    return Run.open(shutil.copytree(finished.folder, tmp_path / finished.folder.name))


def test_a_finished_run_is_found_again_and_reads_as_it_was_written(finished):
    again = Run(tiny_plan(), root=finished.folder.parent)
    assert again.start().status().state == "finished"
    assert not again._workers
    results = again.wait()
    assert results.seeds("tiny") == (0, 1)
    assert results.finals("tiny").shape == (2, 2)
    steps, curves = results.curve("tiny")
    assert steps.tolist() == [1600, 3200]
    assert np.array_equal(curves[:, -1], results.scores()["tiny"])
    assert [len(one.phases) for one in results.learners] == [2, 2]
    assert results.cost.steps == 6400
    assert results.cost.seconds == pytest.approx(results.of("tiny")[0].cost.seconds * 2, rel=0.1)
    assert results.learners[0].policy().card.command == again.plan.command
    assert not (again.folder / store.WORK).exists()


def test_shards_of_one_and_two_learners_end_the_same(finished, tmp_path):
    finished.results()
    parted = trained(tmp_path, processes=2)
    parted.results()
    assert files_of(parted.folder) == files_of(finished.folder)


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        (store.CARD, lambda text: text[:40]),
        (store.CARD, lambda text: "{}"),
        (store.CONFIG, lambda text: text[:-20]),
        (store.LEARNERS, lambda text: text[: len(text) // 2]),
        (store.PHASES, lambda text: text[: text.rindex("\n", 0, -1) + 1]),
        (store.EVALUATIONS, lambda text: text[:-2]),
        (store.EVALUATIONS, lambda text: ""),
    ],
)
def test_a_torn_file_is_refused_with_the_remedy(copied, name, damage):
    path = copied.folder / name
    path.write_text(damage(path.read_text()))
    for read in (copied.results, copied.status, lambda: Run.open(copied.folder).results()):
        if name == store.CONFIG and read is copied.status:
            continue
        with pytest.raises(SettingsError, match="Restore it"):
            read()


def test_a_missing_table_is_refused_and_other_line_ends_are_not(copied):
    path = copied.folder / store.PHASES
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    copied.results()
    path.unlink()
    with pytest.raises(SettingsError, match="Restore it"):
        copied.results()


def worker_at(run, **changes):
    return Worker(run.folder, 0, **({"every": 1e9} | changes))


def interrupted(run, ticks, every=1e9):
    """Trains for some ticks and is asked to stop."""
    worker, left = worker_at(run, every=every), iter(range(ticks))
    pause = worker._pause
    worker._pause = lambda: pause() or next(left, None) is None
    assert not worker.run()
    return worker


def test_a_torn_checkpoint_is_passed_over_for_the_one_before(finished, tmp_path, monkeypatch):
    finished.results()
    run = prepared(tmp_path)
    for count in (100, 130):
        interrupted(run, count)
    shard = store.shard_folder(run.folder, 0)
    latest, previous = shard / checkpoint._LATEST, shard / checkpoint._PREVIOUS
    latest.write_bytes(latest.read_bytes()[:-7])
    worker = worker_at(run)
    assert checkpoint.restore(worker.population, shard)
    assert worker.population.logs[0].steps == 800
    previous.write_bytes(b"")
    worker = worker_at(run)
    assert not checkpoint.restore(worker.population, shard)
    assert worker.population.logs[0].steps == 0
    assert work([str(run.folder), "0"]) == 0
    run.results()
    assert files_of(run.folder) == files_of(finished.folder)


def test_a_full_disk_loses_nothing_and_training_goes_on(finished, tmp_path, monkeypatch):
    finished.results()
    run = prepared(tmp_path)
    interrupted(run, 100)
    shard = store.shard_folder(run.folder, 0)
    before = (shard / checkpoint._LATEST).read_bytes()

    def full(handle, *_):
        os.close(handle)
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("revolver_lab.files.os.fdopen", full)
        worker = interrupted(run, 60, every=1e-9)
    assert "No space left" in worker.message
    assert worker.population.logs[0].steps == 8 * 160
    assert (shard / checkpoint._LATEST).read_bytes() == before
    assert not list(shard.rglob("*.tmp"))
    assert run.status().state == "stopped"
    assert work([str(run.folder), "0"]) == 0
    run.results()
    assert files_of(run.folder) == files_of(finished.folder)


@pytest.mark.slow
def test_a_full_disk_at_the_end_is_reported_and_the_end_comes_later(tmp_path, monkeypatch):
    run = prepared(tmp_path)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(store, "write_shard", full)
        assert work([str(run.folder), "0"]) == 1
    assert run.status().state == "failed"
    assert "No space left" in run.status().message
    with pytest.raises(SettingsError, match="No space left"):
        run.results()
    assert work([str(run.folder), "0"]) == 0
    assert run.status().state == "finished"


def test_orphans_of_a_killed_writer_are_cleared_away(tmp_path):
    run = prepared(tmp_path)
    orphan = store.shard_folder(run.folder, 0) / ".checkpoint.safetensors.abc.tmp"
    orphan.write_bytes(b"x" * 1000)
    interrupted(run, 1)
    assert not orphan.exists()


def test_a_second_worker_is_refused_while_one_is_at_it(tmp_path, capsys):
    run = prepared(tmp_path)
    shard = store.shard_folder(run.folder, 0)
    with claimed(shard):
        assert is_claimed(shard)
        assert work([str(run.folder), "0"]) == 0
        with pytest.raises(ShardTakenError, match="worker is training"), claimed(shard):
            pass
    assert "worker is training" in capsys.readouterr().err
    assert not (shard / store.FAILED).exists()
    assert not (shard / store.PROGRESS).exists()
    assert not is_claimed(shard)


def test_a_failed_worker_is_reported(tmp_path, monkeypatch, capsys):
    run = prepared(tmp_path)
    (run.folder / store.EXPERT).write_bytes(b"torn")
    assert work([str(run.folder), "0"]) == 1
    assert run.status().state == "failed"
    assert "expert.safetensors" in run.status().message
    (run.folder / store.EXPERT).unlink()
    monkeypatch.setattr(Run, "_spawn", lambda run, shard, every: work([str(run.folder), "0"]) or
                        type("Ended", (), {"poll": lambda _: 0})())  # fmt: skip
    assert run.start().status().state == "finished"


def test_what_a_run_holds_so_far_is_read_while_it_trains(tmp_path):
    run = prepared(tmp_path)
    assert so_far(run.folder) == ()
    interrupted(run, 250)
    curves = so_far(run.folder)
    assert [(one.method, one.seed) for one in curves] == [("tiny", 0), ("tiny", 1)]
    assert [phase["alpha"] for phase in curves[0].phases] == [0.5]
    assert [steps for steps, _ in curves[0].evaluations] == [1600]
    work([str(run.folder), "0"])
    assert [steps for steps, _ in so_far(run.folder)[1].evaluations] == [1600, 3200]
    run.results()
    assert [steps for steps, _ in so_far(run.folder)[1].evaluations] == [1600, 3200]


def test_a_learner_that_breaks_is_reported_and_counted(tmp_path, monkeypatch):
    run = prepared(tmp_path)
    worker = worker_at(run)
    left = iter(range(20))

    def poison():
        if next(left, None) is None:
            replay = worker.population.learner.replay
            replay.rows[1, : replay.size[1]] = np.nan
        return False

    worker._pause = poison
    assert worker.run()
    assert run.status().state == "finished"
    assert "tiny-1 was stopped: its numbers are no longer finite" in run.status().message
    results = run.results()
    assert [bool(one.failure) for one in results.learners] == [False, True]
    assert "finite" in store.read_json(run.folder / store.CARD)["failures"]["tiny-1"]
    assert "tiny-1 was stopped" in summary.describe(results)
    assert summary.rows(results)[0]["failures"] == 1


def test_a_kept_run_is_small_and_reads_the_same(finished, tmp_path):
    results = finished.results()
    folder = keep(finished.folder, tmp_path / "recorded")
    assert keep(finished.folder, tmp_path / "recorded") == folder
    assert sum(path.stat().st_size for path in folder.rglob("*")) < 60_000
    again = Run.open(folder).results()
    assert np.array_equal(again.finals("tiny"), results.finals("tiny"))
    assert np.array_equal(again.kept("tiny"), results.kept("tiny"))
    assert again.expert_steps == results.expert_steps > 0
    observation = np.ones((3, 18), np.float32)
    mine, theirs = again.learners[0].policy(), results.learners[0].policy()
    assert np.array_equal(mine(observation), theirs(observation))
    with pytest.raises(PolicyFileError, match="tiny-0"):
        again.learners[1].policy()
    card = store.read_json(folder / store.CARD)
    assert "1 of 2 learners" in card["left_out"]
    for path in folder.rglob("*.*"):
        assert str(tmp_path).encode() not in path.read_bytes()
    both = recorded(ROBOT, folder=tmp_path / "recorded", settings={"steps": 3200, "learner": EAGER})
    assert both.methods == ("tiny",)
    with pytest.raises(SettingsError, match="no recorded run"):
        recorded(ROBOT, folder=tmp_path / "recorded")


def test_an_unfinished_run_cannot_be_kept_or_read(tmp_path):
    run = prepared(tmp_path)
    interrupted(run, 3)
    for read in (run.results, lambda: keep(run.folder, tmp_path / "kept")):
        with pytest.raises(RevolverError):
            read()
    assert not (tmp_path / "kept").exists()


def test_the_command_of_a_plan_gives_the_plan_again():
    from revolver_lab.commands.parser import make_parser
    from revolver_lab.commands.training import _plan

    for task in (None, "dense"):
        plan = Plan(robot=ROBOT, methods=["direct", "revolver-h1"], seeds=[0, 3], task=task)
        words = plan.command.split()
        assert _plan(make_parser("", "").parse_args(words[1:]))[0].name == plan.name
    for change in ({"expert": "0" * 64}, {"evaluate_every": 0}):
        assert "--plan" in dataclasses.replace(plan, **change).command
    assert "--plan" in tiny_plan().command


def wait_for(holds, seconds=60.0):
    until = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < until, "it took too long"
        time.sleep(0.05)


def test_a_run_between_two_jobs_hears_that_it_is_to_stop(tmp_path):
    run = Run(tiny_plan(), root=tmp_path)
    run.prepare(1)  # nobody is at work now
    run.stop(patience=0.0)
    assert (run.folder / store.STOP).exists()


def test_who_asks_as_the_last_step_is_done_is_heard(tmp_path, monkeypatch):
    run = Run(tiny_plan(), root=tmp_path)
    run.prepare(1)

    def finish(worker):
        worker.asked_to_stop = True
        return True

    monkeypatch.setattr(Worker, "run", finish)
    assert train(run.folder, 0, 60.0) == STOPPED
    assert work([str(run.folder), "0"]) == 0  # to be stopped is no failure


def test_stopped_and_started_it_ends_as_if_it_had_not(finished, tmp_path):
    finished.results()
    run = Run(tiny_plan(), root=tmp_path)
    assert run.status().state == "new"
    with pytest.raises(SettingsError, match="Start it"):
        run.results()
    run.start(processes=1)
    wait_for(lambda: run.status().steps > 100)
    assert run.stop().status().state == "stopped"
    stopped = run.status()
    assert 0 < stopped.fraction < 1
    assert all(one.steps < 3200 for one in stopped.learners)
    with pytest.raises(SettingsError, match="Resume it"):
        run.results()
    run.start().wait()
    assert files_of(run.folder) == files_of(finished.folder)


@pytest.mark.slow
def test_an_interrupted_wait_stops_the_run_safely(tmp_path):
    run = Run(tiny_plan(), root=tmp_path).start(processes=1)

    def interrupt(status):
        if status.steps > 200:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run.wait(progress=interrupt, every=0.05)
    assert run.status().state == "stopped"
    assert (store.shard_folder(run.folder, 0) / checkpoint._LATEST).exists()


@pytest.mark.slow
def test_a_worker_told_to_end_by_the_system_writes_a_checkpoint(tmp_path):
    run = Run(tiny_plan(), root=tmp_path).start(processes=1)
    wait_for(lambda: run.status().steps > 0)
    worker = run._workers[0]
    worker.send_signal(signal.SIGTERM)
    assert worker.wait(60) == 0
    assert run.status().state == "stopped"
    assert (store.shard_folder(run.folder, 0) / checkpoint._LATEST).exists()


def test_settings_of_a_start_are_checked(tmp_path):
    for change in ({"processes": 0}, {"processes": 1.5}, {"every": 0}):
        with pytest.raises(SettingsError, match=next(iter(change))):
            Run(tiny_plan(), root=tmp_path).start(**change)
    assert Schedule().xi == 0.12
