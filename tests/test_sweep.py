"""Natural methods in runs; sweeps killed, repeated or started twice lose and double nothing."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from natural_puck import EXPERT, Reach, puck
from small_runs import files_of

from revolver_lab import cli
from revolver_lab.demonstration_sources import record
from revolver_lab.errors import RevolverError, SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.learners.natural.settings import PILOT
from revolver_lab.methods import METHODS, Member
from revolver_lab.natural_methods import NATURAL_METHODS, NaturalMethod
from revolver_lab.natural_population import NaturalPopulation
from revolver_lab.policies import Policy
from revolver_lab.runs import Plan, Run, checkpoint, keep, keeping, recorded, store, worker
from revolver_lab.runs.claim import claimed
from revolver_lab.runs.natural_summary import natural_rows, over_iterations
from revolver_lab.runs.so_far import so_far
from revolver_lab.runs.sweep import sweep
from revolver_lab.runs.sweep_file import plans_of, read_sweep

SMALL = dataclasses.replace(PILOT, trajectories=4, length=20, warm_batches=1)
TINY = {
    "robots": ["adroit-door"], "methods": ["tiny", "npg-like"], "seeds": [0, 1], "steps": 900,
    "evaluate_episodes": 2,
    "method": {
        "tiny": {"settings": {"trajectories": 4, "length": 30, "warm_batches": 1}},
        "npg-like": {"like": "npg-direct",
                     "settings": {"trajectories": 4, "length": 30, "warm_batches": 1}},
    },
}  # fmt: skip
TOML = """robots = ["adroit-door"]
methods = ["tiny", "npg-like"]
seeds = [0, 1]
steps = 900
evaluate_episodes = 2
[method.tiny]
settings = { trajectories = 4, length = 30, warm_batches = 1 }
[method.npg-like]
like = "npg-direct"
settings = { trajectories = 4, length = 30, warm_batches = 1 }
"""


def small(name, like="npg-revolver", **changes):
    return dataclasses.replace(NATURAL_METHODS[like], name=name, settings=SMALL, **changes)


def puck_population(names=("revolver", "imitating"), **changes):
    rows = {
        "revolver": small("revolver"),
        "imitating": small("imitating", "soil", demonstrations=2),
    }
    members = [Member(method=rows[name], seed=3) for name in names]
    arguments = {"expert": EXPERT, "steps": 800, "task": Reach(), "evaluate_episodes": 4}
    return NaturalPopulation(puck(), members, **(arguments | changes))


def told(log):
    plain = log.to_json()
    del plain["wall_time"]
    for row in (*plain["iterations"], *plain["phases"]):
        del row["wall_time"]
    return plain, {k: v.tobytes() for k, v in log.policy.weights.items()}


@pytest.mark.parametrize("name", NATURAL_METHODS)
def test_every_natural_method_travels_as_json(name):
    row = NATURAL_METHODS[name]
    assert NaturalMethod.from_json(json.loads(json.dumps(row.to_json()))) == row


def test_a_natural_method_ends_the_same_alone_and_in_company():
    together = puck_population()
    assert together.run()
    for i, name in enumerate(("revolver", "imitating")):
        alone = puck_population([name])
        assert alone.run()
        assert told(alone.results()[0]) == told(together.results()[i])


@pytest.mark.parametrize("stop", [0, 3, 11, 12, 17])
def test_natural_methods_resumed_from_files_end_as_if_they_had_not_been_stopped(stop, tmp_path):
    left = iter(range(stop))
    first, whole = puck_population(), puck_population()
    assert whole.run()
    assert not first.run(lambda: next(left, None) is None)
    checkpoint.save(first, tmp_path)
    resumed = puck_population()
    assert checkpoint.restore(resumed, tmp_path)
    assert resumed.run()
    assert [*map(told, resumed.results())] == [*map(told, whole.results())]


def test_teachers_are_asked_for_by_name():
    with pytest.raises(SettingsError, match="expert"):
        puck_population(["imitating"], expert=None)


def test_a_plan_of_natural_methods_comes_back_from_its_file_and_has_no_learner():
    plan = Plan(robot="adroit-door", methods=["npg-revolver", "dapg"], seeds=[0])
    assert plan.learner is None
    assert plan.evaluate_every == 0
    assert Plan.from_json(json.loads(json.dumps(plan.to_json()))) == plan


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"methods": ["npg-direct", "direct"]}, "npg-direct"),
        ({"methods": ["npg-direct", METHODS["direct"]]}, "Make a plan for each kind"),
        ({"methods": ["npg-directt"]}, "Did you mean 'npg-direct'"),
        ({"methods": [["npg-direct"]]}, "a list of names and Methods"),
        (
            {"robot": "humanoid-length-mass", "methods": ["npg-direct"]},
            "expert of .humanoid-length",
        ),
        ({"robot": "humanoid-length-mass", "methods": ["npg-scratch"]}, "least_return = None"),
        ({"robot": "cheetah-segment", "methods": ["soil"], "task": "dense"}, "least_return = None"),
    ],
)
def test_plans_that_mix_or_cannot_work_are_refused(changes, text, tmp_path):
    with pytest.raises(RevolverError, match=text):
        Run(Plan(**({"robot": "adroit-door", "seeds": [0]} | changes)), root=tmp_path).prepare(1)


def test_a_task_that_tells_no_success_has_one_from_the_expert_and_whole_episodes():
    plan = Plan(robot="cheetah-segment", methods=["soil", small("own")], seeds=[0])
    soil, own = plan.methods
    usual = NATURAL_METHODS["soil"].settings
    assert soil.least_return == load_expert("cheetah-segment").card.episode_return / 2
    assert soil.settings.length == 200
    batch = soil.settings.trajectories * 200
    assert abs(batch - usual.trajectories * usual.length) <= 100
    assert own == small("own")  # who brings a method has said what it is
    assert "soil" in Plan(robot="cheetah-segment", methods=["soil"], seeds=[0]).command
    assert Plan(robot="adroit-door", methods=["soil"], seeds=[0]).methods == (
        NATURAL_METHODS["soil"],)  # fmt: skip


def test_what_is_carried_of_an_expert_with_another_head_is_its_clone():
    tiny = {"settings": SMALL, "least_return": 50.0}
    rows = [dataclasses.replace(NATURAL_METHODS[name], **tiny) for name in ("npg-direct", "soil")]
    expert = load_expert("cheetah-segment")
    members = [Member(method=row, seed=0) for row in rows]
    population = NaturalPopulation("cheetah-segment", members, expert=expert, steps=100)
    clone = population.policy()
    assert clone.head == "gaussian"
    seen = record(expert, "cheetah-segment", 2, seed=5).observations
    assert np.abs(clone(seen) - expert(seen)).mean() < 0.05
    again = NaturalPopulation("cheetah-segment", members[1:], expert=expert, steps=100).policy()
    for name, array in clone.weights.items():
        assert np.array_equal(array, again.weights[name]), name


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("robots", {"robots": "adroit-door"}),
        ("seeds", {"seeds": []}),
        ("colour", {"colour": 1}),
        ("steps", {"steps": 0}),
        ("adroit-doors", {"robots": ["adroit-doors"]}),
        ("tasks", {"tasks": "sparse"}),
        ("dances", {"method": {"tiny": {"dances": True}}}),
        ("alpha_stepp", {"method": {"tiny": {"gate": {"alpha_stepp": 1}}}}),
        ("Gatter", {"method": {"tiny": {"gate": {"kind": "Gatter"}}}}),
        ("trajectories", {"method": {"tiny": {"settings": {"trajectories": 0}}}}),
        ("npg-revolvers", {"method": {"tiny": {"like": "npg-revolvers"}}}),
        ("method", {"method": 3}),
        ("methods = ", {"methods": [["tiny"]]}),
        ("says something twice", {"robots": ["adroit-door", "adroit-door"]}),
        ("gate = 3", {"method": {"tiny": {"gate": 3}}}),
        ("settings = 'quick'", {"method": {"tiny": {"settings": "quick"}}}),
        ("gate.kind", {"method": {"tiny": {"gate": {"kind": ["SampledGate"]}}}}),
        ("method 3", {"method": {"tiny": {"like": 3}}}),
        ("expert = 'no'", {"method": {"tiny": {"expert": "no"}}}),
        ("least_return = 'much'", {"method": {"tiny": {"least_return": "much"}}}),
        ("xi-0.2 in .*, a name that is taken", {"method": {"xi-0.2": {"gate": {"xi": 0.3}}}}),
    ],
)
def test_a_sweep_that_says_something_unknown_is_refused_by_name(name, changes):
    with pytest.raises(RevolverError, match=name):
        plans_of(TINY | {"methods": ["tiny"]} | changes)


def test_no_jobs_at_all_are_refused_by_command(tmp_path, capsys):
    (tmp_path / "tiny.toml").write_text(TOML)
    assert cli.main(["sweep", str(tmp_path / "tiny.toml"), "--jobs", "0"]) == 2
    assert "jobs = 0. Allowed: a whole number, 1 or more" in capsys.readouterr().err


def test_a_sweep_without_robots_or_no_toml_at_all_is_refused(tmp_path):
    with pytest.raises(SettingsError, match="robots"):
        plans_of({"methods": ["direct"], "seeds": [0]})
    torn = tmp_path / "torn.toml"
    torn.write_text("robots = [")
    for path in (torn, tmp_path / "none.toml"):
        with pytest.raises(SettingsError, match=path.name):
            read_sweep(path)


def test_a_sweep_is_robots_times_rewards_and_a_gate_of_another_kind_starts_anew():
    own = {"method": {"tiny": {"gate": {"kind": "EvaluatedGate", "episodes": 7}}}}
    plans = plans_of(TINY | own | {"methods": ["tiny"], "tasks": ["sparse", "dense"],
                                   "robots": ["adroit-door", "adroit-hammer"]})  # fmt: skip
    assert [(p.robot, p.task) for p in plans] == [
        ("adroit-door", "sparse"), ("adroit-door", "dense"),
        ("adroit-hammer", "sparse"), ("adroit-hammer", "dense"),
    ]  # fmt: skip
    assert plans[0].methods[0].gate.episodes == 7
    assert plans[0].methods[0].gate.threshold == 0.5


@pytest.fixture(scope="module")
def heard():
    return []


@pytest.fixture(scope="module")
def peace(tmp_path_factory, heard):
    """The tiny sweep, undisturbed."""
    return sweep(plans_of(TINY), root=tmp_path_factory.mktemp("peace"), jobs=1,
                 told=lambda *counts: heard.append(counts))[0]  # fmt: skip


def test_a_sweep_tells_of_every_job_that_ends(peace, heard):
    n = len(peace.plan.members)
    assert heard == [(done, n) for done in range(n + 1)]


def test_a_sweep_that_waits_for_another_does_not_repeat_itself(tmp_path, capfd):
    plans, counts = plans_of({**TINY, "seeds": [0]}), []
    run = Run(plans[0], root=tmp_path)
    run.prepare(len(run.plan.members))
    with ThreadPoolExecutor(1) as aside:
        with claimed(store.shard_folder(run.folder, 0)):
            going = aside.submit(sweep, plans, root=tmp_path, jobs=1, every=0.1,
                                 told=lambda *told: counts.append(told))  # fmt: skip
            until = time.monotonic() + 120
            while len(counts) < 2 and time.monotonic() < until:
                time.sleep(0.1)
            time.sleep(2)  # the other job is done: it looks for this one again and again
        going.result()
    n = len(run.plan.members)
    assert counts == sorted(set(counts))
    assert counts[0] == (0, n)
    assert "Wait for it" not in capfd.readouterr().err  # which is what it does


def test_a_sweep_ends_where_its_own_process_is_asked_to_stop(tmp_path, monkeypatch):
    asked = []

    def stopped(folder, shard, every):
        asked.append(shard)
        return worker.STOPPED

    monkeypatch.setattr(worker, "train", stopped)
    with pytest.raises(KeyboardInterrupt):
        sweep(plans_of(TINY), root=tmp_path, jobs=1)
    assert asked == [0]  # and is not given out again


def test_a_sweep_ends_in_tables_that_say_what_every_learner_came_to(peace, tmp_path):
    results = peace.results()
    assert [(one.method, one.seed) for one in results.learners] == [
        ("tiny", 0), ("tiny", 1), ("npg-like", 0), ("npg-like", 1),
    ]  # fmt: skip
    for one in results.learners:
        log = Policy.load(peace.folder / store.POLICIES / f"{one.method}-{one.seed}.safetensors")
        assert log.card.seed == one.seed
        assert len(one.successes) == 2
        assert one.cost.steps >= 900 > one.cost.steps - 4 * 30
        assert one.iterations[-1]["steps"] == one.cost.steps
        assert one.iterations[-1]["alpha"] == (1.0 if one.method == "npg-like" else 0.0)
        assert not one.finished
    row = natural_rows(results)[1]
    assert (row["median_iterations"], row["good"]) == (np.inf, 0)
    assert row["censored_at"] == len(results.of("npg-like")[0].iterations)
    kept = keep(peace.folder, tmp_path)
    again = recorded("adroit-door", folder=tmp_path, natural=True)
    assert again.methods == ("tiny", "npg-like")
    assert (kept / store.ITERATIONS).read_bytes() == (peace.folder / store.ITERATIONS).read_bytes()


def test_a_natural_learner_is_drawn_iteration_by_iteration_as_it_trains_and_afterwards(
    peace, tmp_path, monkeypatch
):
    ended = {(one.method, one.seed): one.iterations for one in peace.results().learners}
    for one in so_far(peace.folder):
        assert one.phases == ended[one.method, one.seed]
    run = Run(plans_of(TINY)[0], root=tmp_path)
    run.prepare(1)
    half = worker.Worker(run.folder, 0, every=1e9)
    left, pause = iter(range(9)), half._pause
    monkeypatch.setattr(half, "_pause", lambda: pause() or next(left, None) is None)
    assert not half.run()  # which leaves a checkpoint, and no tables
    drawn = [(one.method, one.seed, phase["steps"]) for one in so_far(run.folder)
             for phase in one.phases]  # fmt: skip
    assert len(drawn) > 1
    made = [(*who, row["steps"]) for who, rows in ended.items() for row in rows]
    assert set(drawn) < set(made)


def test_event_files_of_natural_learners_hold_every_iteration(peace, tmp_path):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    assert cli.main(["tensorboard", str(peace.folder), "-o", str(tmp_path)]) == 0
    for one in peace.results().learners:
        events = EventAccumulator(str(tmp_path / one.method / str(one.seed)))
        events.Reload()
        for name in ("alpha", "success"):
            found = [(e.step, e.value) for e in events.Scalars(f"phase/{name}")]
            made = [(row["steps"], np.float32(row[name])) for row in one.iterations]
            assert found == made


def test_long_runs_are_thinned_where_they_are_kept_and_say_as_much_as_before(
    peace, tmp_path, monkeypatch
):
    monkeypatch.setattr(keeping, "_MOST_ROWS", 3)
    keep(peace.folder, tmp_path)
    short, long = recorded("adroit-door", folder=tmp_path, natural=True), peace.results()
    assert natural_rows(short) == natural_rows(long)
    for name in ("alpha", "steps"):
        some, every = (over_iterations(r, name)["tiny"] for r in (short, long))
        assert some.shape == every.shape
        assert np.array_equal(some[:, -1], every[:, -1])
        assert (some <= every).all()  # the value before stands in, and both only grow
    assert (
        max(len(one.iterations) for one in short.learners) <= 3 < len(long.learners[0].iterations)
    )


def test_a_sweep_that_is_done_trains_nothing_again(peace):
    before = {path: path.stat().st_mtime_ns for path in peace.folder.rglob("*")}
    sweep(plans_of(TINY), root=peace.folder.parent, jobs=1)
    assert {path: path.stat().st_mtime_ns for path in peace.folder.rglob("*")} == before


def start(root, *words):
    """Starts the tiny sweep by command, in two processes."""
    file = root / "tiny.toml"
    file.write_text(TOML)
    command = [sys.executable, "-m", "revolver_lab.cli", "sweep", str(file), "--root", str(root),
               "--jobs", "2", "--every", "0.3", *words]  # fmt: skip
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                            start_new_session=True)  # fmt: skip


def all_gone(group, seconds=10.0):
    """Whether all processes of a group end within a while."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


def at_work(root):
    """The processes that say they are training."""
    pids = set()
    for path in root.glob(f"*/{store.WORK}/*/{store.PROGRESS}"):
        said = json.loads(path.read_text())
        if said["state"] == "running":  # a quick machine ends a job before it reports again
            pids.add(said["pid"])
    return pids


@pytest.mark.slow
def test_killed_workers_of_a_sweep_lose_no_run_and_double_none(peace, tmp_path):
    going, killed = start(tmp_path), set()
    until = time.monotonic() + 240
    while going.poll() is None and time.monotonic() < until:
        for pid in at_work(tmp_path) - killed:
            if len(killed) < 3:
                os.kill(pid, signal.SIGKILL)
                killed.add(pid)
        time.sleep(0.02)
    assert going.wait(5) == 0, going.stderr.read()
    assert len(killed) >= 2
    (folder,) = tmp_path.glob("adroit-door-*")
    assert files_of(folder) == files_of(peace.folder)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
@pytest.mark.parametrize("how", ["by Ctrl-C", "by its folder"])
def test_a_sweep_that_is_stopped_ends_and_goes_on_from_there(how, jobs, peace, tmp_path):
    going, until = start(tmp_path, "--jobs", jobs), time.monotonic() + 60
    # From the first sign of work on: a quick machine ends a job before it reports a second time.
    while not [*tmp_path.glob(f"*/{store.WORK}/*/{store.PROGRESS}")] and time.monotonic() < until:
        time.sleep(0.01)
    if how == "by Ctrl-C":
        os.killpg(going.pid, signal.SIGINT)
    else:
        Run.open(next(tmp_path.glob("adroit-door-*"))).stop(patience=0.0)
    assert going.wait(30) == 2
    assert "stopped" in going.stderr.read()
    assert all_gone(going.pid)  # nobody is left behind
    assert start(tmp_path).wait(240) == 0
    (folder,) = tmp_path.glob("adroit-door-*")
    assert files_of(folder) == files_of(peace.folder)


@pytest.mark.slow
def test_two_sweeps_of_one_file_share_the_work(peace, tmp_path):
    both = [start(tmp_path), start(tmp_path)]
    assert [one.wait(300) for one in both] == [0, 0], [one.stderr.read() for one in both]
    (folder,) = tmp_path.glob("adroit-door-*")
    assert files_of(folder) == files_of(peace.folder)


@pytest.mark.slow
def test_a_cluster_ends_where_this_machine_does(peace, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as few:
        going = start(tmp_path, "--dask", few.scheduler_address)
        assert going.wait(300) == 0, going.stderr.read()
    (folder,) = tmp_path.glob("adroit-door-*")
    assert files_of(folder) == files_of(peace.folder)


@pytest.mark.slow
def test_a_cluster_that_does_not_answer_is_named(tmp_path):
    with pytest.raises(SettingsError, match=r"127\.0\.0\.1:9"):
        sweep(plans_of(TINY), root=tmp_path, cluster="tcp://127.0.0.1:9")


def test_what_is_usual_depends_on_the_kind_of_method_and_is_trained_by_a_plain_command():
    natural = Plan(robot="adroit-door", methods=["npg-direct"], seeds=[0])
    other = Plan(robot="cheetah-front-leg", methods=["direct"], seeds=[0])
    assert (natural.steps, natural.evaluate_episodes) == (1_536_000, 100)
    assert (other.steps, other.evaluate_episodes) == (72_000, 10)
    assert natural.command == ("revolver-lab transfer adroit-door --methods npg-direct --seeds 0 "
                               "--steps 1536000")  # fmt: skip


def test_one_natural_learner_is_trained_by_command_into_a_folder(tmp_path, capsys):
    words = ["transfer", "adroit-door", "--method", "npg-direct", "--steps", "1", "--seed", "4"]
    assert cli.main([*words, "-o", str(tmp_path / "out")]) == 0
    assert "success on the target 0.00" in capsys.readouterr().out
    assert Policy.load(tmp_path / "out" / "policy.safetensors").card.seed == 4
    assert (tmp_path / "out" / store.ITERATIONS).read_text().count("\n") == 2
