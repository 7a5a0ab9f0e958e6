"""One policy from one robot to another by natural policy gradient, in one call."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.files import output_folder
from revolver_lab.gates import PILOT_GATE, Gate
from revolver_lab.given import count_of, require_call
from revolver_lab.learners.natural.settings import PILOT, NaturalSettings
from revolver_lab.natural_log import Iteration, NaturalLog
from revolver_lab.natural_loop import NaturalTransfer
from revolver_lab.policies import Policy
from revolver_lab.trajectories import Success

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task


def natural_transfer(
    expert: Policy | None,
    evolve: "Evolution | str",
    gate: Gate = PILOT_GATE,
    *,
    algorithm: str = "NPG",
    settings: NaturalSettings = PILOT,
    demonstrations: Demonstrations | None = None,
    steps: int | None = None,
    seed: int = 0,
    task: "str | Task | None" = None,
    success: Success | None = None,
    evaluate_episodes: int = 100,
    nthread: int = 0,
    report: Callable[[Iteration], None] | None = None,
    out: str | Path | None = None,
) -> NaturalLog:
    """Transfers a policy from E(0) to E(1), alpha going on as the gate allows.

    Args:
        expert: pi on E(0), with a Gaussian head; None learns from scratch.
        evolve: The evolution, or the name of a registered one.
        gate: When alpha goes on; `alpha_start=1` is direct transfer.
        algorithm: "NPG", "DAPG" or "SOIL".
        settings: What the learner is made of.
        demonstrations: What a teacher did, for DAPG, or saw, for SOIL.
        steps: Environment steps at which it ends if the gate has not [steps]; None waits for the
            gate, which may be forever.
        seed: Seed of everything random.
        task: A reward of the registered robot, or a task for an evolution of your own.
        success: When a trajectory succeeds; None is the task's own goal.
        evaluate_episodes: Fresh episodes on E(1) at the end; 0 plays none.
        nthread: Threads of the physics; 0 for one per CPU. Results do not depend on it.
        report: Called after every iteration.
        out: Folder to save the log and the policy in; None saves nothing.

    Returns:
        The log, with the policy.

    Raises:
        SettingsError: If something cannot work.
        PolicyFileError: If the expert does not fit the robot, or has no Gaussian head.
        DemonstrationsError: If the demonstrations do not fit the robot.
    """
    evaluate_episodes = count_of("evaluate_episodes", evaluate_episodes, 0, "Try 100.")
    require_call("report", report, "Pass a function of an Iteration.")
    if out is not None:
        output_folder(out)
    loop = NaturalTransfer(
        expert, evolve, gate, algorithm=algorithm, settings=settings, steps=steps, seed=seed,
        demonstrations=demonstrations, task=task, success=success, nthread=nthread, report=report,
    )  # fmt: skip
    loop.run()
    if evaluate_episodes:
        loop.examine(1.0, evaluate_episodes)
    log = loop.result()
    if out is not None:
        log.save(out)
    return log
