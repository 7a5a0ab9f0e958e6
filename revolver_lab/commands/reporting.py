"""Commands that tell what came out: evaluate, report, keep, tensorboard."""

import sys
from pathlib import Path

import revolver_lab as rvl
from revolver_lab import runs
from revolver_lab.commands.parts import Arguments, policy_of, training, wrote
from revolver_lab.errors import SettingsError
from revolver_lab.evaluation import evaluate_both
from revolver_lab.logs import write_table
from revolver_lab.robots import registry
from revolver_lab.runs import Results, Run
from revolver_lab.runs.markdown import markdown
from revolver_lab.runs.natural_summary import is_natural
from revolver_lab.runs.recordings import recorded_kinds
from revolver_lab.runs.so_far import so_far
from revolver_lab.runs.store import CONFIG
from revolver_lab.runs.summary import describe, rows


def evaluate(arguments: Arguments) -> int:
    """Prints unshaped returns of a policy along alpha."""
    alphas = arguments.alpha or list(rvl.lab.ALPHAS)
    policy = policy_of(arguments.name, arguments.policy)
    goal = registry.get(arguments.name).make_task(arguments.task).goal_steps is not None
    asked = (policy, arguments.name, alphas, arguments.episodes, arguments.seed)
    won = [""] * len(alphas)
    if goal:
        returns, told = evaluate_both(*asked, task=arguments.task)
        won = [f"   {row.mean():.2f}" for row in told]
    else:
        returns = rvl.evaluate(*asked, task=arguments.task)
    print("alpha   mean return   lowest   highest" + "   success" * goal)
    for alpha, row, rate in zip(alphas, returns, won, strict=True):
        print(f"{alpha:<7.4g} {row.mean():<13.4g} {row.min():<8.4g} {row.max():<7.4g}{rate}")
    return 0


def report(arguments: Arguments) -> int:
    """Prints one table a run, and writes one file for all."""
    found = [pair for name in arguments.runs for pair in _results(name)]
    for name, results in found:
        told = (markdown if arguments.markdown else describe)(results, arguments.threshold)
        title = f"{results.robot}: {name}" if name != results.robot else name
        print(title)
        print(told, end="\n\n" if len(found) > 1 else "\n")
        if arguments.threshold is not None and is_natural(results):
            print(f"--threshold does not apply to {title}, where episodes tell whether they "
                  "succeeded.", file=sys.stderr)  # fmt: skip
    if arguments.csv is None:
        return 0
    table = [{"run": name} | row for name, results in found
             for row in rows(results, arguments.threshold)]  # fmt: skip
    return wrote(write_table(arguments.csv, table))


def _results(given: str) -> list[tuple[str, Results]]:
    """Results of a folder, or all that is recorded of a robot, each with its title."""
    if (Path(given) / CONFIG).is_file():
        return [(given, Run.open(given).results())]
    if Path(given).name in rvl.names() and not Path(given).is_dir():
        return recorded_kinds(given)
    raise SettingsError(f"run {given!r}", f"a run's folder, or one of {rvl.names()}",
                        "Runs are in out/runs; recorded ones go by their robot.")  # fmt: skip


def keep(arguments: Arguments) -> int:
    """Copies runs into a folder of recorded ones."""
    for folder in arguments.runs:
        wrote(runs.keep(folder, arguments.out))
    return 0


def tensorboard(arguments: Arguments) -> int:
    """Writes event files, again from the beginning each time."""
    out = arguments.out or arguments.folder / "tensorboard"
    learners = so_far(arguments.folder)
    with training():
        from revolver_lab.learners.tensorboard import write_events

        write_events(out, learners)
    print(f"Look: tensorboard --logdir {out}")
    return 0
