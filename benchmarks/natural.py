"""NPG on 16 hands at a door: sampling, an iteration, and a single Gymnasium loop beside it."""

import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from benchmarks.timing import paired, row, seconds
from revolver_lab.envs.vector import make_vec_env
from revolver_lab.gates import SampledGate
from revolver_lab.learners.natural.npg import NPG
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.policies import Policy

NAME, PEER = "adroit-door", "AdroitHandDoor-v1"
N, LENGTH, RUNS, ITERATIONS = 16, 200, 5, 6
SETTINGS = NaturalSettings(trajectories=N, length=LENGTH, warm_batches=0)


class Timed:
    """A Batch whose steps are timed; everything else is passed on."""

    def __init__(self, batch: Any):
        self._batch, self.seconds = batch, 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._batch, name)

    def step(self, *arguments: Any) -> None:
        self.seconds += seconds(lambda: self._batch.step(*arguments))


class Keeping(Timed):
    """A Batch that remembers the controls of every step."""

    def __init__(self, batch: Any, ctrl: np.ndarray):
        super().__init__(batch)
        self._ctrl, self.start, self.kept = ctrl, None, []

    def step(self, *arguments: Any) -> None:
        if self.start is None:
            self.start = self._batch.state.copy()
        self.kept.append(self._ctrl.copy())
        super().step(*arguments)


def bare(env: Any, npg: NPG) -> Callable[[], None]:
    """The physics of one batch of trajectories and nothing else, on the same models."""
    batch = env.batch
    env.batch = kept = Keeping(batch, env._ctrl)
    npg.sample(env)
    env.batch = batch

    def replay() -> None:
        batch.state[:] = kept.start
        for ctrl in kept.kept:
            env._ctrl[:] = ctrl
            batch.step(None, env.task.n_substeps, env._stage)

    return replay


def loop(env: gymnasium.Env, policy: Policy) -> Callable[[], None]:
    """One trajectory in a single Gymnasium environment, actions drawn from the same policy."""
    rng = np.random.default_rng(0)

    def play() -> None:
        seen, _ = env.reset(seed=0)
        for _ in range(LENGTH):
            action = policy(seen, deterministic=False, rng=rng)
            seen, *_ = env.step(action)

    return play


def window(env: Any, alpha: float) -> Callable[[int, np.random.Generator], float]:
    """Robots of the grid, drawn as a transfer draws them at alpha."""
    gate = SampledGate()
    return lambda _, rng: env.evolve.nearest(gate.draw(alpha, rng))


def outside(env: Any, npg: NPG) -> tuple[float, float]:
    """The share of an iteration that is not Batch.step, and the seconds of an iteration."""
    env.batch = timed = Timed(env.batch)
    shares, taken = [], []
    for k in range(ITERATIONS):
        timed.seconds, start = 0.0, time.perf_counter()
        npg.iterate(env, window(env, 0.01 * k))
        taken.append(time.perf_counter() - start)
        shares.append(1 - timed.seconds / taken[-1])
    env.batch = timed._batch
    return statistics.median(shares), statistics.median(taken)


def run() -> list[dict[str, object]]:
    """Measure all rows."""
    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    # Dense, so that there is something to learn from: the sparse one would skip the update.
    env = make_vec_env(NAME, N, task="dense", seed=0, autoreset_mode="NextStep")
    env.draw_alpha = window(env, 0.0)
    npg = NPG(env.observation_space.shape[1], env.action_space.shape[1], SETTINGS)
    sampling = paired(bare(env, npg), lambda: npg.sample(env), RUNS)
    share, taken = outside(env, npg)
    theirs = gymnasium.make(PEER, max_episode_steps=LENGTH)
    single = paired(loop(theirs, npg.policy()), lambda: npg.sample(env), RUNS)
    rate = N * LENGTH / single["peer_s"]
    most = N * single["ours_s"] / sampling["ours_s"]  # if all but the physics were free
    return [
        row(f"sampling {N} x {LENGTH} steps of {NAME}", "bare Batch.step on the same models",
            ">= 0.85", sampling["ratio"], f"{sampling['peer_s']:.2f} s a batch"),
        row(f"an NPG iteration of {N} x {LENGTH} steps", "its own wall time: share outside physics",
            "<= 0.15", share, f"{taken:.2f} s an iteration"),
        row(f"sampling {N} x {LENGTH} steps of {NAME}", f"one loop over gymnasium's {PEER}",
            ">= 3", N * single["ratio"],
            f"{rate:.0f} environment steps/s, {RUNS} runs; bare Batch.step would be {most:.2f}"),
    ]  # fmt: skip


if __name__ == "__main__":
    for line in run():
        print(line)
