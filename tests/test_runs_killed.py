"""A run killed at fifty random moments ends as one that was left in peace, bit for bit."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from small_runs import files_of, tiny_plan

from revolver_lab.runs import Run, checkpoint, store

KILLS = 50

# A worker that is forked, not started anew, at every kill: importing torch takes longer than what
# is tested. It is killed while it restores, trains, writes checkpoints or ends.
NURSERY = """
import os, sys
from revolver_lab.runs.worker import main
import revolver_lab.learners.stacked.learner
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        os.setsid()
        os._exit(main([sys.argv[1], line.strip(), "--every", "0.02"]))
    print(child, flush=True)
    print(os.waitpid(child, 0)[1], flush=True)
"""


class Nursery:
    """Starts workers quickly, one at a time."""

    def __init__(self, folder):
        self.process = subprocess.Popen(
            [sys.executable, "-c", NURSERY, str(folder)], stdin=subprocess.PIPE, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
        )  # fmt: skip

    def train(self, shard, seconds=None):
        """Trains a shard, and kills its process group after so many seconds; says if it did."""
        self.process.stdin.write(f"{shard}\n")
        self.process.stdin.flush()
        child = int(self.process.stdout.readline())
        if seconds is not None:
            time.sleep(seconds)
            with contextlib.suppress(ProcessLookupError):  # it has come to its end before
                os.killpg(child, signal.SIGKILL)
        return os.WIFSIGNALED(int(self.process.stdout.readline()))

    def close(self):
        self.process.stdin.close()
        self.process.wait(30)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_killed_fifty_times_it_ends_as_if_it_had_not_been(tmp_path):
    runs = [Run(tiny_plan(), root=tmp_path / name) for name in ("peace", "war")]
    for run in runs:
        run.prepare(1)
    for shard, run in enumerate(runs[:1]):
        nursery = Nursery(run.folder)
        assert not nursery.train(shard)
        nursery.close()
    work, nursery = store.shard_folder(runs[1].folder, 0), Nursery(runs[1].folder)
    rng, kills, found = np.random.default_rng(0), 0, set()
    while kills < KILLS:
        if (work / store.DONE).exists():  # so soon: once more from the beginning
            shutil.rmtree(work)
            work.mkdir()
        kills += nursery.train(0, rng.uniform(0, 2.0))
        found |= {path.name.split(".")[1] for path in work.rglob(".*.tmp")}
        found |= {path.name for path in work.glob(checkpoint._NEXT)}
    assert not nursery.train(0)
    nursery.close()
    for run in runs:
        assert run.status().state == "finished"
    assert files_of(runs[1].folder) == files_of(runs[0].folder)
    assert "checkpoint-next" in found  # killed in the middle of writing one, too


@pytest.mark.slow
def test_killed_between_any_two_renames_a_checkpoint_is_left(tmp_path, monkeypatch):
    from revolver_lab.runs.worker import Worker

    run = Run(tiny_plan(), root=tmp_path)
    run.prepare(1)
    worker = Worker(run.folder, 0)
    worker.population.run(lambda: worker.population.logs[0].steps >= 400)
    checkpoint.save(worker.population, worker.work)
    renamed = os.replace
    for survivors in range(3):
        worker.population.run(lambda until=480 + 80 * survivors:
                              worker.population.logs[0].steps >= until)  # fmt: skip
        left = iter(range(survivors))

        def replace(source, target, left=left):
            if next(left, None) is None:
                raise KeyboardInterrupt
            renamed(source, target)

        with monkeypatch.context() as patch:
            patch.setattr(os, "replace", replace)
            with pytest.raises(KeyboardInterrupt):
                checkpoint.save(worker.population, worker.work)
        fresh = Worker(run.folder, 0)
        assert checkpoint.restore(fresh.population, worker.work)
        expected = 480 + 80 * survivors if survivors else 400
        assert fresh.population.logs[0].steps == expected
