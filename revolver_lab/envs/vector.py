"""The vector door: n robots of n alphas stepped together."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from gymnasium.vector import AutoresetMode

from revolver_lab.envs.core import DrawAlpha, Stage
from revolver_lab.envs.robot_vector import RobotVectorEnv
from revolver_lab.given import count_of, seed_of

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task

__all__ = ["RobotVectorEnv", "make_vec_env"]


def make_vec_env(
    robot: "str | Evolution",
    n: int,
    *,
    task: "str | Task | None" = None,
    alphas: float | Sequence[float] | np.ndarray = 0.0,
    draw_alpha: DrawAlpha | None = None,
    seed: int | Sequence[int] | None = None,
    nthread: int = 0,
    autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
) -> RobotVectorEnv:
    """Return n robots of one evolution, each of its own alpha, stepped together.

    Args:
        robot: A registered name, or an ``Evolution``.
        n: Number of simulations, at least 1.
        task: "sparse", "dense" or what the robot offers (by default its first); or a ``Task``.
        alphas: Which robots to start with: one alpha for all, or (n,), in [0, 1].
        draw_alpha: Called as ``draw_alpha(i, rng)`` when an episode of simulation i starts, with
            a random stream of that simulation; returns its alpha.
        seed: Seed of all random streams; None takes one from the system. Several seeds part the
            simulations into as many groups of equal size, and each group draws what it would
            draw alone.
        nthread: Threads; 0 for one per CPU. Results do not depend on it.
        autoreset_mode: "SameStep" or "NextStep", as gymnasium defines them.

    Raises:
        UnknownNameError: If there is no such robot or task.
        AlphaError: If an alpha is not in [0, 1].
        SettingsError: If n, the number of alphas or the mode cannot work.
    """
    n = count_of("n", n, 1, "Ask for one or more.")
    nthread = count_of("nthread", nthread, 0, "0 is one for each CPU.")
    if seed is not None and not isinstance(seed, Sequence | np.ndarray):
        seed = seed_of(seed)
    return RobotVectorEnv(
        Stage(robot, task),
        n,
        alphas=alphas,
        draw_alpha=draw_alpha,
        seed=seed,
        nthread=nthread,
        autoreset_mode=autoreset_mode,
    )
