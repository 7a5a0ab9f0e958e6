"""Transfers by natural policy gradient, on tasks with a goal and without."""

import sys
from collections.abc import Sequence

from revolver_lab.commands.parts import Arguments, policy_of, wrote
from revolver_lab.evaluation import evaluate
from revolver_lab.experts import home_return
from revolver_lab.files import output_folder
from revolver_lab.methods import Member
from revolver_lab.natural_log import Iteration
from revolver_lab.natural_methods import NaturalMethod, natural_fitted
from revolver_lab.natural_population import NaturalPopulation
from revolver_lab.progress import ProgressLines, describe_iteration
from revolver_lab.robots import registry

_EPISODES = 20
_SEED = 3_000_000  # of the episodes that tell what an expert returns: no training sees them


def natural(arguments: Arguments, row: NaturalMethod) -> int:
    """Trains one learner, into a folder of its own."""
    if arguments.out is not None:
        output_folder(arguments.out)
    lines, (chosen,) = ProgressLines(sys.stderr), suited(arguments, [row])

    def report(_: Member, made: Iteration) -> None:
        lines.write([describe_iteration(chosen.name, made)])

    expert = policy_of(arguments.name, arguments.policy) if chosen.needs_expert else None
    population = NaturalPopulation(
        arguments.name, [Member(method=chosen, seed=arguments.seed or 0)], expert=expert,
        steps=arguments.steps, task=arguments.task, nthread=0, report=report,
    )  # fmt: skip
    population.run()
    log = population.results()[0]
    print(f"{chosen.name} on {log.robot}: {len(log.iterations)} iterations, {log.steps} steps, "
          f"{log.wall_time:.0f} s; success on the target {log.success:.2f}")  # fmt: skip
    if arguments.out is not None:
        log.save(arguments.out)
    return wrote(arguments.out)


def suited(arguments: Arguments, rows: Sequence[NaturalMethod]) -> list[NaturalMethod]:
    """Returns methods of the table as the task needs them: one without a goal asks for a return.

    What counts is `half_of_home`. Where no card says what the expert returns, it plays, once.
    """
    task = registry.get(arguments.name).make_task(arguments.task)
    if task.goal_steps is not None or not rows:
        return list(rows)
    home = _home(arguments, any(row.needs_expert for row in rows))
    made = [natural_fitted(row, task, home) for row in rows]
    if home is not None:
        print(f"The expert returns {home:.4g} on the source: from {made[0].least_return:.4g} on, "
              "an episode counts as a success.", file=sys.stderr)  # fmt: skip
    return made


def _home(arguments: Arguments, needed: bool) -> float | None:
    """What the expert returns on the source; None where there is none, and none is needed."""
    shipped = arguments.policy == "expert"
    home = home_return(arguments.name, arguments.task) if shipped else None
    if home is not None or (shipped and not needed):
        return home
    expert = policy_of(arguments.name, arguments.policy)
    return float(evaluate(expert, arguments.name, 0.0, _EPISODES, seed=_SEED,
                          task=arguments.task).mean())  # fmt: skip
