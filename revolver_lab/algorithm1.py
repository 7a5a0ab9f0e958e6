"""Algorithm 1 of the paper: a policy follows its robot along a continuous evolution."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from revolver_lab.cards import ModelCard, command, commit, versions
from revolver_lab.errors import MissingExtraError, SettingsError
from revolver_lab.evaluation import evaluate
from revolver_lab.learners.settings import COURSE, LearnerSettings
from revolver_lab.logs import TransferLog
from revolver_lab.policies import Policy
from revolver_lab.recorder import Progress, Recorder
from revolver_lab.schedule import Schedule

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.learners.sb3 import Sb3Learner
    from revolver_lab.tasks.base import Task

_EVALUATION_SEEDS = 1_000_000  # evaluations start elsewhere than the training of any seed


class Learner(Protocol):
    """What the loop asks of a learner; `learners.sb3.Sb3Learner` is one."""

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Draws actions, (n, A), for observations, (n, O)."""
        ...

    def store(
        self, observation: np.ndarray, action: np.ndarray, reward: np.ndarray,
        following: np.ndarray, terminated: np.ndarray, betas: np.ndarray,
    ) -> None:  # fmt: skip
        """Remembers transitions; rewards come unshaped."""
        ...

    def update(self) -> None:
        """Improves the policy from what is remembered."""
        ...

    def clean(self, low: float, high: float) -> None:
        """Forgets the transitions whose beta is outside [low, high]."""
        ...


def run(
    learner: Learner, env: "RobotVectorEnv", schedule: Schedule, log: Recorder, seed: int
) -> None:
    """Runs Algorithm 1; numbers are its lines in the paper.

    All simulations of `env` go through lines 14 to 25 side by side, each with its own beta. An
    episode that ended starts anew at the next step, which is therefore no transition.

    Args:
        learner: Holds pi, initialised to the expert, and the replay R, empty (line 10).
        env: Simulations that draw the beta of each episode through `draw_alpha`.
        schedule: alpha, l_k, xi, N_e and the window.
        log: Counts; it sees unshaped returns only.
        seed: Seed of the robots and starts drawn.
    """
    alpha = schedule.alphas[0]  # 10: alpha <- 0
    env.draw_alpha = lambda _, rng: schedule.draw(alpha, rng)  # 14, 15: beta, M_beta <- E(beta)
    state, _ = env.reset(seed=seed)  # 16: s_0
    running = np.ones(env.num_envs, dtype=bool)
    for alpha in schedule.alphas:  # 11, 29: while alpha < 1; alpha <- alpha + l_k
        learner.clean(*schedule.kept(alpha))  # 31: keep beta in [alpha, alpha + xi]
        while not log.phase_over(alpha):  # 12, 17: N_e episodes of N steps
            action = learner.act(state)  # 19: a ~ pi(. | s)
            following, reward, terminated, truncated, info = env.step(action)  # 20 (and 16)
            moved = (state, action, reward, following, terminated, info["alpha"])
            if running.any():
                learner.store(*(array[running] for array in moved))  # 22, 23: r' when sampled
                learner.update()  # 24, 25
            ended = running & (terminated | truncated)
            returns = info["episode"]["r"][ended] if ended.any() else np.empty(0)
            log.count(alpha, int(running.sum()), returns, info["alpha"][ended])
            state, running = following, ~ended
        log.close(alpha)


def transfer(
    expert: Policy | None,
    evolve: "Evolution | str",
    schedule: Schedule | None = None,
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
        schedule: The path of alpha; `Schedule(alpha_start=1)` is direct transfer.
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
    from revolver_lab.envs.vector import make_vec_env

    schedule = schedule or Schedule()
    schedule.check(learner.simulations)
    env = make_vec_env(evolve, learner.simulations, task=task, seed=seed, nthread=1,
                       autoreset_mode="NextStep")  # fmt: skip
    _check_steps(steps, schedule, learner.simulations, env.task.episode_steps)
    student = _student(learner, env, schedule.shaping, seed)
    if expert is not None:
        student.adopt(expert)

    def on_target(policy: Policy) -> np.ndarray:
        return evaluate(policy, env.evolve, schedule.alphas[-1], evaluate_episodes,
                        seed=_EVALUATION_SEEDS + seed, task=task)[0]  # fmt: skip

    log = Recorder(schedule, env.task.episode_steps, steps=steps, report=progress,
                   snapshot=student.policy, evaluate=on_target if evaluate_episodes else None,
                   evaluate_every=evaluate_every)  # fmt: skip
    run(student, env, schedule, log, seed)
    log.evaluate()
    policy = log.best if keep_best and log.best else student.policy()
    result = _result(log, policy, env.evolve.name, _settings(schedule, learner, expert), seed)
    if out is not None:
        result.save(out)
    return result


def _student(
    settings: LearnerSettings, env: "RobotVectorEnv", shaping: float, seed: int
) -> "Sb3Learner":
    """Builds a learner for an environment's sizes."""
    try:
        from revolver_lab.learners.sb3 import Sb3Learner
    except ImportError as error:
        raise MissingExtraError(
            f"training without {error.name}", "torch and stable-baselines3",
            "Install them: pip install 'revolver-lab[train]'.",
        ) from error  # fmt: skip
    sizes = env.observation_space.shape[1], env.action_space.shape[1]  # type: ignore[index]
    return Sb3Learner(settings, *sizes, shaping=shaping, seed=seed)


def _check_steps(steps: int | None, schedule: Schedule, simulations: int, length: int) -> None:
    """Refuses a number of steps at which a fixed schedule may not come to alpha = 1."""
    rounds = [-(-schedule.episodes(alpha) // simulations) for alpha in schedule.alphas[:-1]]
    needed = (sum(rounds) + 1) * simulations * length
    if steps is not None and steps < needed:
        raise SettingsError(
            f"steps = {steps}", f"{needed} or more, for {len(rounds)} phases and the last",
            "Raise the steps or alpha_step, or lower episodes_per_phase.",
        )  # fmt: skip


def _settings(
    schedule: Schedule, learner: LearnerSettings, expert: Policy | None
) -> dict[str, Any]:
    """Returns what it takes to run this again, as plain values."""
    return {
        "schedule": dataclasses.asdict(schedule), "learner": learner.to_json(),
        "expert": expert.card.to_json() if expert else None, "versions": versions(),
        "command": command(), "commit": commit(),
    }  # fmt: skip


def _result(
    log: Recorder, policy: Policy, robot: str, settings: dict[str, Any], seed: int
) -> TransferLog:
    """Freezes what happened."""
    last = log.phases[-1]
    scores = [record.mean for record in log.evaluations]
    score = (max(scores) if policy is log.best else scores[-1]) if scores else None
    card = ModelCard(
        robot=robot, alpha=last.alpha, algorithm=settings["learner"]["algorithm"], seed=seed,
        steps=log.steps, episode_return=score,
        versions=settings["versions"], command=settings["command"], commit=settings["commit"],
    )  # fmt: skip
    return TransferLog(
        robot=robot, phases=tuple(log.phases), evaluations=tuple(log.evaluations),
        steps=log.steps, evaluation_steps=log.evaluation_steps, wall_time=round(log.seconds, 3),
        reached_target=last.episodes > 0, seed=seed, settings=settings,
        policy=policy.with_card(card),
    )  # fmt: skip
