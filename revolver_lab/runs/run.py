"""A run: asked for by a plan, found again if it is there, trained in worker processes."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from revolver_lab.errors import SettingsError
from revolver_lab.experts import load_expert
from revolver_lab.files import asset_folder, write_json
from revolver_lab.given import count_of, require, require_path, require_time
from revolver_lab.policies import Policy
from revolver_lab.runs import shapes, store
from revolver_lab.runs.checking import check_machine
from revolver_lab.runs.claim import is_claimed
from revolver_lab.runs.collecting import collect
from revolver_lab.runs.ended import ended
from revolver_lab.runs.plan import Plan
from revolver_lab.runs.results import Results
from revolver_lab.runs.status import Status, read
from revolver_lab.runs.tables import read_results

ROOT = Path("out/runs")
"""Where runs are kept, below the folder one works in."""

_ENVIRONMENT = {
    "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
    # glibc otherwise returns temporaries to the system and faults them in again: 13 % slower
    "MALLOC_TRIM_THRESHOLD_": "268435456", "MALLOC_MMAP_THRESHOLD_": "33554432",
}  # fmt: skip

PROCESSES = 2
"""Workers of a run: two of one thread each keep two cores busier than one of two threads."""
EVERY = 60.0
"""Seconds between checkpoints [s]."""

_WORKERS: dict[Path, list[subprocess.Popen]] = {}
"""A worker claims its shard only once it has imported everything; until then this knows of it."""


class Run:
    """A population in a folder: configuration, curves, policies and a card.

    The folder's name is a hash of the plan, so that asking for the same thing again finds it,
    whether it is finished, stopped or running, and whether it was trained here or is shipped.

    Args:
        plan: What to train.
        root: Where the folder is, or goes.
        expert: What methods with an expert begin with; None is the shipped one.

    Attributes:
        folder: The run's folder.
        watchers: Told the status now and then by whoever waits, as `wait` keeps the kernel busy.

    Example:
        >>> plan = Plan(robot="cheetah-front-leg", methods=["scratch"], seeds=[0])
        >>> Run(plan, root="no/such/folder").status().state
        'new'
    """

    def __init__(self, plan: Plan, *, root: str | Path = ROOT, expert: Policy | None = None):
        require("plan", plan, Plan, "Pass Plan(robot=..., methods=[...], seeds=[0]).")
        require("expert", expert, (Policy, type(None)), "Pass rvl.load_expert(name).")
        require_path("root", root)
        self.plan, self._expert = plan, expert
        shipped = asset_folder("results") / plan.name
        here = Path(root) / plan.name
        ready = (shipped / store.CARD).exists() and not here.exists()
        self.folder = shipped if ready else here
        if (self.folder / store.CONFIG).exists():
            store.read_plan(self.folder)  # refuses a folder of another version
        self.watchers: list[Callable[[Status], None]] = []

    @classmethod
    def open(cls, folder: str | Path) -> "Run":
        """Returns the run of an existing folder.

        Raises:
            SettingsError: If it holds no run, or one of another version.
        """
        require_path("folder", folder)
        folder = Path(folder)
        run = cls(store.read_plan(folder), root=folder.parent)
        run.folder = folder
        return run

    @property
    def _workers(self) -> list[subprocess.Popen]:
        """Returns the workers started from here; all runs of this folder share them."""
        return _WORKERS.setdefault(self.folder.resolve(), [])

    def start(self, *, processes: int = PROCESSES, every: float = EVERY) -> "Run":
        """Trains in the background, from where it was stopped; returns at once.

        Args:
            processes: Workers; fixed by the first start, as each keeps its own checkpoints.
            every: Seconds between checkpoints [s].

        Raises:
            SettingsError: If the expert is not the planned one, or the replays would not fit into
                memory.
            PolicyFileError: If the expert does not fit the robot.
        """
        processes = count_of("processes", processes, 1, f"Try {PROCESSES}.")
        require_time("every", every)
        state = self.status().state
        if state == "running" and (self.folder / store.STOP).exists():
            state = self.stop().status().state  # somebody asked for that first
        if state == "finished" or (state == "running" and self._workers):
            return self
        self.prepare(min(processes, len(self.plan.members)))
        (self.folder / store.STOP).unlink(missing_ok=True)
        for shard in range(store.count_shards(self.folder)):
            work = store.shard_folder(self.folder, shard)
            if not (work / store.DONE).exists() and not is_claimed(work):
                (work / store.FAILED).unlink(missing_ok=True)
                self._workers.append(self._spawn(shard, every))
        return self

    def prepare(self, processes: int) -> None:
        """Makes the folder; what is there stays."""
        expert, begun = None, store.count_shards(self.folder) > 0
        if self.plan.expert is not None and not (self.folder / store.EXPERT).exists():
            expert = self.plan.check_expert(self._expert or load_expert(self.plan.robot))
        if not begun:
            check_machine(self.plan, expert)
        write_json(self.folder / store.CONFIG, self.plan.to_json())
        if expert is not None:
            expert.save(self.folder / store.EXPERT)
        if not begun:
            for shard in range(processes):
                store.shard_folder(self.folder, shard).mkdir(parents=True, exist_ok=True)
            write_json(self.folder / store.SHARDS, {"shards": processes})

    def _spawn(self, shard: int, every: float) -> subprocess.Popen:
        """Starts one worker; it has one thread, and outlives an interrupted cell."""
        work = store.shard_folder(self.folder, shard)
        command = [sys.executable, "-m", "revolver_lab.runs.worker", str(self.folder), str(shard),
                   "--every", str(every)]  # fmt: skip
        with open(work / store.LOG, "a") as log:
            return subprocess.Popen(
                command, stdout=log, stderr=log, stdin=subprocess.DEVNULL, start_new_session=True,
                env=os.environ | _ENVIRONMENT,
            )  # fmt: skip

    def stop(self, *, patience: float = 30.0) -> "Run":
        """Asks the workers to write a checkpoint and end, and waits for them.

        Args:
            patience: How long to wait [s].
        """
        # A sweep that is between two jobs has nobody at work, and goes on: it has to be told, too.
        if self.status().state != "finished" and (self.folder / store.WORK).is_dir():
            (self.folder / store.STOP).touch()
            until = time.monotonic() + patience
            while self.status().state == "running" and time.monotonic() < until:
                time.sleep(0.1)
        return self

    def wait(
        self, *, progress: Callable[[Status], None] | None = None, every: float = 0.5
    ) -> Results:
        """Waits for the end and returns the results; interrupting it stops the run, safely.

        Args:
            progress: Called with the status now and then.
            every: Seconds between looks [s].

        Raises:
            SettingsError: If a worker failed, or the run was stopped.
        """
        told = [*self.watchers, *([progress] if progress else [])]
        try:
            while (now := self.status()).state == "running":
                for tell in told:
                    tell(now)
                time.sleep(every)
        except KeyboardInterrupt:
            self.stop()
            raise
        for tell in told:
            tell(now)
        return self.results()

    def status(self) -> Status:
        """Looks at the folder, and returns how the run is doing.

        Raises:
            SettingsError: If a file of it is torn.
        """
        self._workers[:] = [worker for worker in self._workers if worker.poll() is None]
        card = self.folder / store.CARD
        if not card.exists():
            try:
                now = self._unfinished()
                if now.state == "running" or not card.exists():
                    return now
            except SettingsError:  # of a file that somebody else who has just collected took away
                if not card.exists():
                    raise
        return ended(self.folder)

    def _unfinished(self) -> Status:
        """Looks at the shards."""
        shards = store.shard_folders(self.folder)
        place = {member.name: i for i, member in enumerate(self.plan.members)}
        told = [read(work / store.PROGRESS, place) for work in shards]
        learners = sorted((one for some, _ in told for one in some),
                          key=lambda one: place[f"{one.method}-{one.seed}"])  # fmt: skip
        failures = [store.read_json(w / store.FAILED, shapes.FAILED)["message"] for w in shards
                    if (w / store.FAILED).exists()]  # fmt: skip
        messages = failures or [said["message"] for _, said in told if said.get("message")]
        return Status(
            state=self._state(shards, bool(failures)), learners=tuple(learners),
            steps=sum(one.steps for one in learners),
            steps_planned=self.plan.steps * len(self.plan.members),
            seconds=max((said.get("seconds", 0.0) for _, said in told), default=0.0),
            message=" ".join(dict.fromkeys(messages)),
        )  # fmt: skip

    def _state(self, shards: Sequence[Path], failed: bool) -> str:
        """Says in a word how an unfinished run is."""
        if not shards:
            return "running" if self._workers else "new"  # a deleted one, until they notice
        if all((work / store.DONE).exists() for work in shards):
            collect(self.folder, self.plan)
            return "finished"
        if self._workers or any(is_claimed(work) for work in shards):
            return "running"
        return "failed" if failed else "stopped"

    def results(self) -> Results:
        """Returns what the learners came to.

        Raises:
            SettingsError: If the run is not finished; it says how far it is.
        """
        now = self.status()
        if now.state != "finished":
            remedy = {
                "new": "Start it: run.start().", "running": "Wait for it: run.wait().",
                "stopped": "Resume it: run.start().", "failed": now.message,
            }[now.state]  # fmt: skip
            raise SettingsError(f"a run that is {now.state}, at {now.fraction:.0%}",
                                "a finished run", remedy)  # fmt: skip
        return read_results(self.folder)
