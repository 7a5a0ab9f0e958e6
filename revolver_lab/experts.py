"""Experts: the policies on E(0) that a transfer starts from, and how to train them again."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path

from revolver_lab.cards import command, commit, versions
from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.evaluation import evaluate
from revolver_lab.files import asset_folder, output_folder
from revolver_lab.given import seed_of
from revolver_lab.learners.settings import COURSE, LearnerSettings
from revolver_lab.logs import TransferLog, write_table
from revolver_lab.policies import Policy
from revolver_lab.recorder import Progress
from revolver_lab.robots import registry
from revolver_lab.schedule import Schedule
from revolver_lab.transferring import transfer


@dataclasses.dataclass(frozen=True, kw_only=True)
class Stage:
    """One stage of an expert's training, on the source robot.

    Attributes:
        task: The reward, by its name in the registry.
        steps: Environment steps [steps].
        learner: The learning algorithm and its settings.
    """

    task: str
    steps: int
    learner: LearnerSettings


# Dense until it runs, then the sparse reward that the transfer will have (facts, section 7).
_SB3 = dataclasses.replace(COURSE, engine="stable-baselines3")  # what the shipped ones came by
_CHEETAH = (
    Stage(task="dense", steps=64_000,
          learner=dataclasses.replace(_SB3, updates=2, ent_coef="auto_0.1")),
    Stage(task="sparse", steps=32_000, learner=_SB3),
)  # fmt: skip

_KEEN = dataclasses.replace(COURSE, updates=2, ent_coef="auto_0.1")
# An update for every transition, on large batches: with _KEEN an Ant was at some 500 after as many.
_EAGER = dataclasses.replace(COURSE, updates=8, batch_size=256, ent_coef="auto_0.1",
                             learning_starts=5_000, buffer_size=400_000)  # fmt: skip

RECIPES: Mapping[str, tuple[Stage, ...]] = {
    "cheetah-front-leg": _CHEETAH,
    "cheetah-short-legs": _CHEETAH,
    "cheetah-long-legs": _CHEETAH,
    "cheetah-segment": (),  # the cheetah's expert, lifted: as good at alpha = 0 without training
    "ball-in-cup-weak-motors": (
        Stage(task="dense", steps=32_000, learner=_KEEN),
        Stage(task="sparse", steps=12_000, learner=_KEEN),
    ),
    "ant-length-mass": (
        Stage(task="dense", steps=400_000, learner=_EAGER),
        Stage(task="dense", steps=500_000, learner=_EAGER),
    ),
    "ant-leg-emerge": (),  # the Ant's expert, lifted
}
"""Robot -> how its expert is trained; the cheetahs share one source and so one expert."""


def _lifted_cheetah() -> Policy:
    """Returns the cheetah's expert for the robot with a segment, by zero insertion."""
    from revolver_lab.robots.cheetah_segment import cheetah_places

    return load_expert("cheetah-front-leg").lifted(*cheetah_places())


def _lifted_ant() -> Policy:
    """Returns the Ant's expert for the Ant with feet, by zero insertion."""
    from revolver_lab.robots.ant import ant_places

    return load_expert("ant-length-mass").lifted(*ant_places())


LEARNERS: Mapping[str, LearnerSettings] = {"ball-in-cup-weak-motors": _KEEN}
"""Robot -> what transfers on it learn with, where that is not the course's."""

STARTS: Mapping[str, Callable[[], Policy]] = {
    "cheetah-segment": _lifted_cheetah,
    "ant-leg-emerge": _lifted_ant,
}
"""Robot -> what its expert's training begins with; the others begin from scratch."""

_EVALUATE_EVERY = 4_000  # [steps]
_EVALUATIONS = 40  # of a stage at most: those of long episodes cost more than the training
_FRESH_SEED = 2_000_000  # of the episodes on a card: neither training nor selection saw them


def course_learner(name: str) -> LearnerSettings:
    """Returns what transfers on a robot learn with at course scale.

    Args:
        name: One of `revolver_lab.names()`.

    Example:
        >>> course_learner("cheetah-front-leg") == COURSE
        True
    """
    return LEARNERS.get(name, COURSE)


def expert_folder() -> Path:
    """Returns the folder of shipped experts."""
    return asset_folder("experts")


def _expert_file(name: str) -> Path:
    """Returns where the expert of a robot is, if there is one."""
    return Path(registry.get(name).expert or expert_folder() / f"{name}.safetensors")


def load_expert(name: str) -> Policy:
    """Loads the expert of a registered robot, critic included; torch is not needed.

    Args:
        name: One of `revolver_lab.names()`.

    Raises:
        UnknownNameError: If there is no such robot.
        PolicyFileError: If no expert is shipped for it.

    Example:
        >>> load_expert("cheetah-front-leg").action_size
        6
    """
    path = _expert_file(name)
    if not path.is_file():
        shipped = sorted(p.stem for p in expert_folder().glob("*.safetensors"))
        where = f", which is to be in {path}" if registry.get(name).expert else ""
        raise PolicyFileError(f"expert of {name!r}{where}", f"one of {shipped}",
                              f"Train one: revolver-lab train-expert {name}.")  # fmt: skip
    return Policy.load(path)


def home_return(name: str, task: str | None = None) -> float | None:
    """Returns what the shipped expert returned on the source robot, unshaped; None if unknown.

    Args:
        name: One of `revolver_lab.names()`.
        task: The reward; the card speaks of the robot's first, which is None.

    Example:
        >>> home_return("cheetah-segment"), home_return("humanoid-length-mass")
        (160.5, None)
    """
    if not _expert_file(name).is_file() or task not in (None, registry.get(name).usual_task):
        return None
    return load_expert(name).card.episode_return


def train_expert(
    name: str,
    *,
    seed: int = 0,
    out: str | Path | None = None,
    stages: tuple[Stage, ...] | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Policy:
    """Trains an expert on E(0), stage after stage, with the loop that transfers: alpha stays 0.

    Args:
        name: One of `revolver_lab.names()`.
        seed: Seed of everything random.
        out: Folder for NAME.safetensors, its card NAME.json and its curve NAME.csv; None
            saves nothing.
        stages: The recipe; None is the robot's own.
        progress: Called as episodes end, see `revolver_lab.recorder.Progress`.

    Returns:
        The expert, critic included; its card holds its mean return over 20 episodes.

    Raises:
        UnknownNameError: If there is no such robot.
        SettingsError: If no recipe is known for it.
    """
    robot, seed = registry.get(name), seed_of(seed)
    if out is not None:
        output_folder(out)
    stages = RECIPES.get(name) if stages is None else stages
    if stages is None or not (stages or name in STARTS):
        raise SettingsError(f"no recipe for {robot.name!r}", f"{sorted(RECIPES)}",
                            "Give it steps: revolver-lab train-expert NAME --steps 64000; or pass "
                            "stages=(Stage(...), ...) of your own.")  # fmt: skip
    policies = [STARTS[name]()] if name in STARTS else []
    rows, done = [], sum(policy.card.steps for policy in policies)
    stay = Schedule(alpha_end=0.0, xi=0.0)
    for stage in stages:
        log = transfer(policies[-1] if policies else None, name, stay, learner=stage.learner,
                       steps=stage.steps, seed=seed, task=stage.task, evaluate_episodes=20,
                       evaluate_every=max(_EVALUATE_EVERY, stage.steps // _EVALUATIONS),
                       keep_best=True, progress=progress)  # fmt: skip
        rows += _curve(log, stage, done)
        policies.append(log.policy)
        done += log.steps
        if out is not None:
            write_table(Path(out) / f"{name}.csv", rows)
    expert, task = policies[-1], stages[-1].task if stages else None
    fresh = evaluate(expert, name, 0.0, 20, seed=_FRESH_SEED, task=task)
    chosen = "The best of its last stage's evaluations" if stages else "Lifted by zero insertion"
    expert = expert.with_card(dataclasses.replace(
        expert.card, robot=name, seed=seed, steps=done, episode_return=float(fresh.mean()),
        versions=versions(), command=command(), commit=commit(),
        note=f"{chosen}; the return is of 20 episodes more.",
    ))  # fmt: skip
    if out is not None:
        expert.save(Path(out) / f"{name}.safetensors")
    return expert


def _curve(log: TransferLog, stage: Stage, before: int) -> list[dict]:
    """Returns the stage's training curve, one row an evaluation."""
    return [
        {"task": stage.task, "steps": before + record.steps, "mean_return": record.mean,
         "lowest": min(record.returns), "highest": max(record.returns)}
        for record in log.evaluations
    ]  # fmt: skip
