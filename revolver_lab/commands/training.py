"""Commands that train: train-expert, transfer."""

import sys
from collections.abc import Callable, Sequence

import numpy as np

import revolver_lab as rvl
from revolver_lab.commands.natural import natural, suited
from revolver_lab.commands.parts import Arguments, policy_of, shown, training, wrote
from revolver_lab.errors import SettingsError
from revolver_lab.experts import Stage, course_learner, load_expert
from revolver_lab.methods import METHODS, look_up
from revolver_lab.natural_methods import NATURAL_METHODS, NaturalMethod
from revolver_lab.policies import Policy
from revolver_lab.progress import ProgressLines, describe, describe_batches
from revolver_lab.recorder import Progress
from revolver_lab.robots import registry
from revolver_lab.runs import LearnerStatus, Plan, Run, Status
from revolver_lab.runs.run import EVERY, PROCESSES, ROOT
from revolver_lab.runs.store import CONFIG, read_plan
from revolver_lab.runs.summary import describe as describe_results
from revolver_lab.weights import digest


def train_expert(arguments: Arguments) -> int:
    """Trains the expert of a robot."""
    stages = None
    if arguments.steps is not None:
        task = arguments.task or registry.get(arguments.name).usual_task
        learner = course_learner(arguments.name)
        stages = (Stage(task=task, steps=arguments.steps, learner=learner),)
    elif arguments.task is not None:
        raise SettingsError("--task without --steps", "--task with --steps", "Try --steps 64000.")
    with training():
        rvl.train_expert(arguments.name, seed=arguments.seed, out=arguments.out, stages=stages,
                         progress=shown(arguments.name))  # fmt: skip
    return wrote(arguments.out)


def transfer(arguments: Arguments) -> int:
    """Trains one learner, or a run of many."""
    one = {f"--{k}" for k in ("method", "seed", "out") if getattr(arguments, k) is not None}
    said = ("methods", "seeds", "plan", "processes", "root", "every")
    many = {f"--{k}" for k in said if getattr(arguments, k) is not None}
    asked = arguments.name or arguments.steps or arguments.task or many & {"--methods", "--seeds"}
    planned = arguments.plan is not None and asked
    if (one and many) or planned or not (arguments.name or arguments.plan):
        raise SettingsError(
            f"transfer {arguments.name or ''} {' '.join(sorted(one | many))}",
            "NAME with --method, --seed, --out; or NAME with --methods, --seeds; or --plan alone; "
            "the last two with --processes, --root, --every",
            "Try: revolver-lab transfer cheetah-front-leg --methods direct revolver --seeds 0 1 2.",
        )
    with training():
        return _run(arguments) if many else _one(arguments)


def _one(arguments: Arguments) -> int:
    """One learner, into a folder of its own."""
    chosen = look_up(arguments.method or "revolver", {**METHODS, **NATURAL_METHODS})
    if isinstance(chosen, NaturalMethod):
        return natural(arguments, chosen)
    expert = policy_of(arguments.name, arguments.policy) if chosen.expert else None
    _check_kind(arguments.name, chosen.name, expert)
    log = rvl.transfer(
        expert, arguments.name, chosen, steps=arguments.steps, seed=arguments.seed or 0,
        task=arguments.task, progress=shown(arguments.name), out=arguments.out,
    )  # fmt: skip
    print(f"{chosen.name} on {log.robot}: {log.steps} steps, {log.wall_time:.0f} s")
    for found in log.evaluations[-1:]:
        print(f"mean return on the target {found.mean:.4g}")
    return wrote(arguments.out)


def _check_kind(robot: str, method: str, expert: Policy | None) -> None:
    """Refuses an expert of natural methods for the others: SAC and TD3 have no such networks."""
    if expert is not None and expert.head == "gaussian":
        raise SettingsError(
            f"{method} on {robot}, whose expert is one of natural methods",
            f"one of {[name for name, row in NATURAL_METHODS.items() if row.needs_expert]}, or "
            "methods without an expert", f"Try: revolver-lab transfer {robot} --method "
            "npg-revolver.",
        )  # fmt: skip


def _run(arguments: Arguments) -> int:
    """Methods times seeds, into a run's folder; the same run is found again."""
    plan, expert = _plan(arguments)
    run = Run(plan, root=arguments.root or ROOT, expert=expert)
    if run.status().state != "finished":
        carrying = [one.method.name for one in plan.members if one.method.needs_expert]
        if plan.learner is not None and carrying:
            _check_kind(plan.robot, carrying[0], expert or load_expert(plan.robot))
        run.start(
            processes=PROCESSES if arguments.processes is None else arguments.processes,
            every=EVERY if arguments.every is None else arguments.every,
        )
        print(f"{len(plan.members)} learners into {run.folder}", file=sys.stderr)
    try:
        results = run.wait(progress=_told())
    except KeyboardInterrupt:
        print("A checkpoint is written; the same command goes on from it.", file=sys.stderr)
        raise
    print(run.folder)
    print(describe_results(results))
    return 0


def _plan(arguments: Arguments) -> tuple[Plan, Policy | None]:
    """What to train, and the expert if it is not the shipped one."""
    if arguments.plan is not None:
        folder = arguments.plan.parent if arguments.plan.name == CONFIG else arguments.plan
        plan = read_plan(folder)
    else:
        names = arguments.methods or ["revolver"]
        rows = suited(arguments, [NATURAL_METHODS[n] for n in names if n in NATURAL_METHODS])
        made = {row.name: row for row in rows}
        plan = Plan(robot=arguments.name, methods=[made.get(name, name) for name in names],
                    seeds=[0] if arguments.seeds is None else arguments.seeds,
                    steps=arguments.steps, task=arguments.task,
                    expert=_hash(arguments))  # fmt: skip
    own = arguments.policy != "expert"
    return plan, policy_of(plan.robot, arguments.policy) if own else None


def _hash(arguments: Arguments) -> str | None:
    """The hash of an expert of one's own; None is the shipped one."""
    if arguments.policy == "expert":
        return None
    return digest(policy_of(arguments.name, arguments.policy).weights)


def _told() -> Callable[[Status], None]:
    """A callback that tells on stderr how a run is doing: a line for each method."""
    lines = ProgressLines(sys.stderr)

    def tell(status: Status) -> None:
        if status.state == "running" and status.steps:
            names = sorted({one.method for one in status.learners if one.steps})
            lines.write([_line(status, name) for name in names])

    return tell


def _line(status: Status, name: str) -> str:
    """How the learners of a method are doing, on average."""
    some = [one for one in status.learners if one.method == name]
    won = [one.success for one in some if one.success is not None]
    if not won:
        return describe(name, _average(status, some))
    return describe_batches(
        name, round(np.mean([one.phase for one in some])),
        float(np.mean([one.alpha for one in some])), float(np.mean(won)),
        sum(one.steps for one in some), status.seconds_left,
    )  # fmt: skip


def _average(status: Status, some: Sequence[LearnerStatus]) -> Progress:
    """How learners of Algorithm 1 are doing, on average."""
    returns = [one.episode_return for one in some if one.episode_return is not None]
    return Progress(
        phase=round(np.mean([one.phase for one in some])), phases=some[0].phases,
        alpha=float(np.mean([one.alpha for one in some])), steps=sum(one.steps for one in some),
        episode_return=float(np.mean(returns)) if returns else float("nan"),
        seconds=status.seconds, seconds_left=status.seconds_left,
    )  # fmt: skip
