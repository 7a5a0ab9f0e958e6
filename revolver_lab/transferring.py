"""One policy from one robot to another: a population of one learner."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from revolver_lab.files import output_folder
from revolver_lab.given import require, require_call, seed_of
from revolver_lab.learners.settings import COURSE, LearnerSettings
from revolver_lab.logs import TransferLog
from revolver_lab.methods import Member, Method
from revolver_lab.policies import Policy
from revolver_lab.population import Population
from revolver_lab.recorder import Progress
from revolver_lab.schedule import Schedule

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.tasks.base import Task


def transfer(
    expert: Policy | None,
    evolve: "Evolution | str",
    schedule: "Schedule | Method | None" = None,
    *,
    learner: LearnerSettings = COURSE,
    steps: int | None = None,
    seed: int = 0,
    task: "str | Task | None" = None,
    evaluate_every: int = 0,
    evaluate_episodes: int = 10,
    keep_best: bool = False,
    progress: Callable[[Progress], None] | None = None,
    out: str | Path | None = None,
) -> TransferLog:
    """Transfers a policy from the source robot E(0) to the target robot E(1).

    Args:
        expert: pi on E(0), its critic included where it has one; None learns from scratch.
        evolve: The evolution, or the name of a registered one.
        schedule: The path of alpha; `Schedule(alpha_start=1)` is direct transfer. Or a method,
            which says what is carried, too.
        learner: The learning algorithm and its settings.
        steps: Environment steps in all [steps]; the last phase, at alpha = 1, takes what the
            others leave. None ends with the schedule's own last phase.
        seed: Seed of everything random.
        task: A reward of the registered robot, or a task for an evolution of your own.
        evaluate_every: Environment steps between evaluations on E(1); 0 is only at the end.
        evaluate_episodes: Episodes of an evaluation; 0 evaluates never.
        keep_best: Return the policy of the best evaluation, rather than the last policy.
        progress: Called as episodes end, see `Progress`.
        out: Folder to save the log and the policy in; None saves nothing.

    Returns:
        The log, with the policy.

    Raises:
        SettingsError: If a phase is shorter than an episode, or the steps do not reach alpha = 1.
        MissingExtraError: If torch or stable-baselines3 is not installed.
        PolicyFileError: If the expert does not fit the robot or the learner.
    """
    require("expert", expert, (Policy, type(None)), "Pass rvl.load_expert(name).")
    require("schedule", schedule, (Schedule, Method, type(None)), "Pass rvl.Schedule().")
    require("learner", learner, LearnerSettings, "Leave it out, or pass LearnerSettings(...).")
    require_call("progress", progress, "Pass a function of a Progress.")
    if out is not None:
        output_folder(out)
    seed, given = seed_of(seed), schedule or Schedule()
    method = given if isinstance(given, Method) else Method(name="transfer", schedule=given)

    def report(_: Member, heard: Progress) -> None:
        if progress is not None:
            progress(heard)

    population = Population(
        evolve, [Member(method=method, seed=seed)], settings=learner, expert=expert, steps=steps,
        task=task, evaluate_every=evaluate_every, evaluate_episodes=evaluate_episodes,
        report=report,
    )  # fmt: skip
    population.run()
    result = population.results(keep_best=keep_best)[0]
    if out is not None:
        result.save(out)
    return result
