"""Twenty learners at once against stable-baselines3, and against their matrix products alone."""

import dataclasses
import functools
import time
from collections.abc import Callable

import numpy as np
import torch
from benchmarks.timing import paired, row

from revolver_lab.experts import load_expert
from revolver_lab.learners.sb3 import Sb3Learner
from revolver_lab.learners.settings import COURSE, PAPER, LearnerSettings
from revolver_lab.learners.stacked.learner import StackedLearner
from revolver_lab.methods import members
from revolver_lab.population import Population

ROBOT, LEARNERS, ROUNDS = "cheetah-front-leg", 20, 7
SIZES = 18, 6  # a cheetah's observation and action


def filled(learner: StackedLearner | Sb3Learner, learners: int, simulations: int) -> None:
    """Puts 3,000 random transitions into every replay."""
    rng, n = np.random.default_rng(0), learners * simulations
    for _ in range(-(-3000 // simulations)):
        normal = rng.standard_normal((n, 2 * SIZES[0] + 1)).astype(np.float32)
        action = rng.uniform(-1, 1, (n, SIZES[1])).astype(np.float32)
        learner.store(np.ones(n, dtype=bool), normal[:, : SIZES[0]], action, normal[:, -1],
                      normal[:, SIZES[0] : -1], np.zeros(n, dtype=bool), np.zeros(n))  # fmt: skip


def updating(settings: LearnerSettings, learners: int, updates: int) -> Callable[[], None]:
    """Returns what makes so many updates of every learner."""
    active = np.ones(learners, dtype=bool)
    chosen = members(["revolver"], range(learners))
    if learners == 1:
        learner = Sb3Learner(settings, *SIZES, chosen[0])
    else:
        learner = StackedLearner(settings, *SIZES, chosen, capacity=5000)
    filled(learner, learners, settings.simulations)
    started = dataclasses.replace(settings, updates=updates, learning_starts=1)
    learner.settings = started
    return lambda: learner.update(active)


def ticking(engine: str, learners: int, ticks: int) -> Callable[[], None]:
    """Returns what takes so many ticks of the whole loop: act, step, remember, update."""
    settings = dataclasses.replace(COURSE, engine=engine)
    population = Population(
        ROBOT, members(["revolver"], range(learners)), settings=settings, steps=72_000,
        expert=load_expert(ROBOT), evaluate_episodes=0,
    )  # fmt: skip
    population.run(functools.partial(_after, [300]))  # past the first update

    def run() -> None:
        population.run(functools.partial(_after, [ticks]))

    return run


def _after(left: list[int]) -> bool:
    """Says stop after so many questions."""
    left[0] -= 1
    return left[0] < 0


def products_seconds(settings: LearnerSettings) -> float:
    """Seconds that the matrix products of one learner's update take at torch.matmul's own speed.

    Forward passes of the actor (for s and s') and of both critics (target, regression, and the
    actor's loss); a backward pass costs two products a layer where weights learn, and one where
    only the gradient of the input is wanted.
    """
    width, batch = settings.hidden[0], settings.batch_size
    actor = SIZES[0] * width + width * width + width * 2 * SIZES[1]
    critic = 2 * (sum(SIZES) * width + width * width + width)
    flops = 2 * batch * (actor * (1 + 3) + critic * (1 + 3 + 2))
    a = torch.randn(LEARNERS, batch, width)
    b = torch.randn(LEARNERS, width, width)
    taken = []
    for _ in range(ROUNDS * 3):
        start = time.perf_counter()
        torch.matmul(a, b)
        taken.append(time.perf_counter() - start)
    return flops / (2 * LEARNERS * batch * width * width / float(np.median(taken)))


def _against_sb3(what: str, settings: LearnerSettings, aim: float, ours: int, theirs: int) -> dict:
    """Learner-updates a second, ours over stable-baselines3's; one thread each."""
    sb3 = dataclasses.replace(settings, engine="stable-baselines3")
    took = paired(updating(settings, LEARNERS, ours), updating(sb3, 1, theirs), ROUNDS)
    mine, peer = took["ours_s"] / ours / LEARNERS, took["peer_s"] / theirs
    ratio = ours * LEARNERS / theirs / took["ratio"]
    return row(what, "stable-baselines3, one learner", f">= {aim}", ratio,
               f"{mine * 1e3:.2f} ms a learner-update, stable-baselines3 {peer * 1e3:.2f} ms; "
               "one thread each")  # fmt: skip


def _products(settings: LearnerSettings, updates: int) -> dict:
    """The time of an update over that of its products alone."""
    work, ratios, mine = updating(settings, LEARNERS, updates), [], []
    work()
    for _ in range(ROUNDS):
        bound = products_seconds(settings)
        start = time.perf_counter()
        work()
        mine.append((time.perf_counter() - start) / updates / LEARNERS)
        ratios.append(mine[-1] / bound)
    return row(f"SAC update, {LEARNERS} learners, nets 2x256, batch 256",
               "its matrix products at torch.matmul's speed", "<= 1.5", float(np.median(ratios)),
               f"{np.median(mine) * 1e3:.2f} ms a learner-update; one thread")  # fmt: skip


def run() -> list[dict]:
    """Measures the four rows."""
    torch.set_num_threads(1)
    whole = paired(ticking("stacked", LEARNERS, 60), ticking("stable-baselines3", 1, 60), ROUNDS)
    rows = [
        _against_sb3(f"SAC updates, {LEARNERS} learners, nets 2x64, batch 64", COURSE, 12, 20, 40),
        row(f"Algorithm 1 end to end, {LEARNERS} cheetah learners, nets 2x64, batch 64",
            "stable-baselines3, one learner", ">= 8", LEARNERS / whole["ratio"],
            f"{whole['ours_s'] / 60 / LEARNERS * 1e3:.2f} ms a learner-tick (8 environment steps "
            f"and an update), stable-baselines3 {whole['peer_s'] / 60 * 1e3:.2f} ms; one thread"),
        _against_sb3(f"SAC updates, {LEARNERS} learners, nets 2x256, batch 256",
                     dataclasses.replace(PAPER, simulations=8), 2.5, 2, 10),
        _products(dataclasses.replace(PAPER, simulations=8), 2),
    ]  # fmt: skip
    return rows


if __name__ == "__main__":
    for line in run():
        print(line)
