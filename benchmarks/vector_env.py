"""The vector environment: 64 Ants of 64 alphas, against bare physics and gymnasium's own way."""

import time
from collections.abc import Callable

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from mujoco.batch import Batch

from revolver_lab.envs.single import RobotEnv
from revolver_lab.envs.vector import make_vec_env

NAME, N = "ant-length-mass", 64
ROUNDS, STEPS = 11, 10


def seconds(work: Callable[[], None]) -> float:
    """Seconds that one call takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def interleaved(works: dict[str, Callable[[], None]]) -> dict[str, np.ndarray]:
    """Seconds of each work, (ROUNDS,), taken in turns so that the machine's moods hit all alike."""
    for work in works.values():
        work()
    rounds = [{name: seconds(work) for name, work in works.items()} for _ in range(ROUNDS)]
    return {name: np.array([r[name] for r in rounds]) for name in works}


def bare_batch(env) -> tuple[Batch, Callable[[np.ndarray], None]]:
    """A Batch on the same models that is stepped and nothing else; its controls are set."""
    batch = Batch(env.models[0], N, 0)
    batch.set_models(env.models)
    batch.reset()
    ctrl = batch.bind("ctrl")

    def step(controls: np.ndarray) -> None:
        ctrl[:] = controls
        batch.step(nstep=env.task.n_substeps)

    return batch, step


def run() -> list[dict]:
    """Measure both rows; ratio > 1 means the vector environment is faster."""
    alphas = np.linspace(0, 1, N)
    env = make_vec_env(NAME, N, alphas=alphas, seed=0)
    sync = SyncVectorEnv(
        [lambda a=a, i=i: RobotEnv(NAME, alpha=a, simulation=i) for i, a in enumerate(alphas)],
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    batch, bare_step = bare_batch(env)
    actions = np.random.default_rng(0).uniform(-1, 1, (STEPS, N, env.models[0].nu))
    env.reset()
    sync.reset(seed=[0] * N)

    def bare() -> None:
        # the robots are where the environment's are, so that both meet the same contacts
        batch.state[:] = env.batch.state
        for a in actions:
            bare_step(a)

    def vector() -> None:
        for a in actions:
            env.step(a)

    def singles() -> None:
        for a in actions:
            sync.step(a)

    taken = interleaved({"bare": bare, "vector": vector, "singles": singles})
    rate = N * STEPS / np.median(taken["vector"])
    detail = f"{rate:.0f} environment steps/s; median of {ROUNDS} rounds of {STEPS} steps"
    return [
        row("bare Batch.step on the same models", 0.85, taken["bare"] / taken["vector"], detail),
        row("gymnasium's SyncVectorEnv", 2.0, taken["singles"] / taken["vector"], detail),
    ]


def row(against: str, aim: float, ratios: np.ndarray, detail: str) -> dict:
    """One line of the table: the median over rounds, with its quartiles in the detail."""
    low, high = np.percentile(ratios, [25, 75])
    return {
        "work": f"make_vec_env step, {N} Ants of {N} alphas",
        "against": against,
        "ratio": round(float(np.median(ratios)), 3),
        "aim": f">= {aim}",
        "detail": f"{detail}; quartiles {low:.2f} to {high:.2f}",
    }


if __name__ == "__main__":
    for line in run():
        print(line)
