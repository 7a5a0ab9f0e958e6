"""Twenty learners on two cores against stable-baselines3, and against their products alone."""

import dataclasses
import multiprocessing
import os
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from benchmarks.timing import row
from revolver_lab.experts import load_expert
from revolver_lab.learners.settings import COURSE, PAPER, LearnerSettings
from revolver_lab.methods import members
from revolver_lab.population import Population

ROBOT, LEARNERS, ROUNDS = "cheetah-front-leg", 20, 9
SIZES = 18, 6  # a cheetah's observation and action
WIDE = dataclasses.replace(PAPER, simulations=8)


def updating(settings: LearnerSettings, learners: int) -> Callable[[int], None]:
    """Returns what makes so many updates of every learner, on 3,000 random transitions each."""
    from revolver_lab.learners.sb3 import Sb3Learner
    from revolver_lab.learners.stacked.learner import StackedLearner

    chosen, n = members(["revolver"], range(learners)), learners * settings.simulations
    if settings.stacks:
        learner: Any = StackedLearner(settings, *SIZES, chosen, capacity=5000)
    else:
        learner = Sb3Learner(settings, *SIZES, chosen[0])
    rng = np.random.default_rng(0)
    for _ in range(3000 // settings.simulations):
        normal = rng.standard_normal((n, 2 * SIZES[0] + 1)).astype(np.float32)
        action = rng.uniform(-1, 1, (n, SIZES[1])).astype(np.float32)
        learner.store(np.ones(n, dtype=bool), normal[:, : SIZES[0]], action, normal[:, -1],
                      normal[:, SIZES[0] : -1], np.zeros(n, dtype=bool), np.zeros(n))  # fmt: skip
    active = np.ones(learners, dtype=bool)

    def update(count: int) -> None:
        learner.settings = dataclasses.replace(settings, updates=count, learning_starts=1)
        learner.update(active)

    return update


def ticking(settings: LearnerSettings, learners: int) -> Callable[[int], None]:
    """Returns what takes so many ticks of the whole loop: act, step, remember, update."""
    population = Population(
        ROBOT, members(["revolver"], range(learners)), settings=settings, steps=72_000,
        expert=load_expert(ROBOT), evaluate_episodes=0,
    )  # fmt: skip

    def run(ticks: int) -> None:
        left = [ticks + 1]

        def pause() -> bool:
            left[0] -= 1
            return left[0] == 0

        population.run(pause)

    run(300)  # past the first update
    return run


def serve(pipe: Connection, what: str, settings: LearnerSettings, learners: int, threads: int):
    """Works in a process of its own, as often as it is told to."""
    import torch

    work = {"update": updating, "tick": ticking}[what](settings, learners)
    torch.set_num_threads(threads)
    pipe.send("ready")
    while count := pipe.recv():
        work(count)
        pipe.send("done")


class Side:
    """Processes that work at the same time, timed together.

    Args:
        what: "update" or "tick".
        settings: Of the learners.
        shares: Learners of each process.
        threads: Threads of each.
        count: Updates or ticks in a round.
    """

    def __init__(
        self, what: str, settings: LearnerSettings, shares: list[int], threads: int, count: int
    ):
        context = multiprocessing.get_context("spawn")
        self.learners, self.count = sum(shares), count
        self.pipes, self.processes = [], []
        for share in shares:
            ours, theirs = context.Pipe()
            process = context.Process(target=serve, args=(theirs, what, settings, share, threads))
            process.start()
            self.pipes.append(ours)
            self.processes.append(process)
        for pipe in self.pipes:
            pipe.recv()

    def seconds(self) -> float:
        """Returns the time of one update, or tick, of one learner [s]."""
        start = time.perf_counter()
        for pipe in self.pipes:
            pipe.send(self.count)
        for pipe in self.pipes:
            pipe.recv()
        return (time.perf_counter() - start) / self.count / self.learners

    def close(self) -> None:
        """Ends the processes."""
        for pipe, process in zip(self.pipes, self.processes, strict=True):
            pipe.send(0)
            process.join()


def stock(settings: LearnerSettings) -> LearnerSettings:
    """The same learner of stable-baselines3 with everything else as it comes."""
    kwargs = {"policy_kwargs": {"net_arch": list(settings.hidden)}}
    return dataclasses.replace(settings, engine="stable-baselines3", options=kwargs)


def against(what: str, name: str, settings: LearnerSettings, aim: float, counts: tuple[int, int]):
    """Two processes of ten learners, against one learner of stable-baselines3 on both cores."""
    half = LEARNERS // 2
    sides = {
        "ours": Side(what, settings, [half, half], 1, counts[0]),
        "theirs": Side(what, stock(settings), [1], os.cpu_count() or 1, counts[1]),
        "theirs, one thread": Side(what, stock(settings), [1], 1, counts[1]),
        "ours, one core": Side(what, settings, [LEARNERS], 1, counts[0] // 2),
    }
    for side in sides.values():
        side.seconds()
    rounds = [{key: side.seconds() for key, side in sides.items()} for _ in range(ROUNDS)]
    for side in sides.values():
        side.close()
    took = {key: np.array([r[key] for r in rounds]) for key in sides}
    one = float(np.median(took["theirs, one thread"] / took["ours, one core"]))
    told = ", ".join(f"{key} {np.median(times) * 1e3:.2f}" for key, times in took.items())
    return row(f"{name}: {LEARNERS} learners on two cores",
               "one learner of stable-baselines3, as it comes", f">= {aim}",
               float(np.median(took["theirs"] / took["ours"])),
               f"ms a learner: {told}; thread against thread {one:.1f}")  # fmt: skip


def products_seconds(settings: LearnerSettings) -> float:
    """Seconds that the matrix products of one learner's update take at torch.matmul's own speed.

    Forward passes of the actor (for s and s') and of both critics (target, regression, and the
    actor's loss); a backward pass costs two products a layer where weights learn, and one where
    only the gradient of the input is wanted.
    """
    import torch

    width, batch = settings.hidden[0], settings.batch_size
    actor = SIZES[0] * width + width * width + width * 2 * SIZES[1]
    critic = 2 * (sum(SIZES) * width + width * width + width)
    flops = 2 * batch * (actor * (1 + 3) + critic * (1 + 3 + 2))
    a, b = torch.randn(LEARNERS, batch, width), torch.randn(LEARNERS, width, width)
    taken = []
    for _ in range(30):
        start = time.perf_counter()
        torch.matmul(a, b)
        taken.append(time.perf_counter() - start)
    return flops * float(np.median(taken)) / (2 * LEARNERS * batch * width * width)


def products() -> dict[str, object]:
    """The time of an update over that of its products alone, on one thread."""
    work, ratios, mine = updating(WIDE, LEARNERS), [], []
    work(1)
    for _ in range(ROUNDS):
        bound = products_seconds(WIDE)
        start = time.perf_counter()
        work(2)
        mine.append((time.perf_counter() - start) / 2 / LEARNERS)
        ratios.append(mine[-1] / bound)
    return row(f"SAC update, {LEARNERS} learners, nets 2x256, batch 256",
               "its matrix products at torch.matmul's speed", "<= 1.5", float(np.median(ratios)),
               f"{np.median(mine) * 1e3:.2f} ms a learner-update; one thread")  # fmt: skip


def run() -> list[dict[str, object]]:
    """Measures the four rows."""
    return [
        against("update", "SAC updates, nets 2x64, batch 64", COURSE, 12, (24, 40)),
        against("tick", "Algorithm 1 end to end, nets 2x64, batch 64", COURSE, 8, (40, 40)),
        against("update", "SAC updates, nets 2x256, batch 256", WIDE, 2.5, (4, 8)),
        products(),
    ]


if __name__ == "__main__":
    for line in run():
        print(line)
