"""From E(0) to E(1) by natural policy gradient: iterations, and a gate that lets alpha on."""

import dataclasses
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from revolver_lab.cards import ModelCard, command, commit, versions
from revolver_lab.demonstrations import Demonstrations
from revolver_lab.envs import snapshot
from revolver_lab.gates import PILOT_GATE, Gate, Position
from revolver_lab.given import count_of, require, seed_of
from revolver_lab.learners.natural.algorithms import make_learner
from revolver_lab.learners.natural.settings import PILOT, NaturalSettings
from revolver_lab.natural_log import EXAMINED, Iteration, NaturalLog, Trial, phases_of
from revolver_lab.policies import Policy
from revolver_lab.trajectories import Success, sample

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.learners.natural.npg import IterationReport
    from revolver_lab.tasks.base import Task


class NaturalTransfer:
    """One learner on its way, which can be stopped and resumed between two iterations.

    Args:
        expert: pi on E(0), with a Gaussian head; None learns from scratch.
        evolve: The evolution, or the name of a registered one.
        gate: When alpha goes on; `alpha_start=1` is direct transfer.
        algorithm: "NPG", "DAPG" or "SOIL".
        settings: What the learner is made of.
        demonstrations: What a teacher did, for DAPG, or saw, for SOIL.
        steps: Environment steps at which it ends if the gate has not [steps]; the iteration that
            reaches them is made whole.
        seed: Seed of everything random.
        task: A reward of the registered robot, or a task for an evolution of your own.
        success: When a trajectory succeeds; None is the task's own goal.
        nthread: Threads of the physics; 0 for one per CPU. Results do not depend on it.
        report: Called after every iteration.

    Attributes:
        position: Where it is on its path.
        iterations: What happened so far.
        trials: Evaluations so far.
        failure: Why it was stopped, or "".
    """

    def __init__(
        self, expert: Policy | None, evolve: "Evolution | str", gate: Gate = PILOT_GATE, *,
        algorithm: str = "NPG", settings: NaturalSettings = PILOT,
        demonstrations: Demonstrations | None = None, steps: int | None = None, seed: int = 0,
        task: "str | Task | None" = None, success: Success | None = None, nthread: int = 0,
        report: Callable[[Iteration], None] | None = None,
    ):  # fmt: skip
        require("expert", expert, (Policy, type(None)), "Pass rvl.load_expert(name).")
        require("gate", gate, Gate, "Pass SampledGate(), or leave it out.")
        require("settings", settings, NaturalSettings, "Pass NaturalSettings(), or leave it out.")
        require("demonstrations", demonstrations, (Demonstrations, type(None)),
                "Pass Demonstrations.load(path).")  # fmt: skip
        require("success", success, (Success, type(None)), "Pass Success(...), or leave it out.")
        seed = seed_of(seed)
        if steps is not None:
            steps = count_of("steps", steps, 1, "Try 1_000_000; None waits for the gate.")
        self._make = (evolve, task, nthread)
        self.env = self._environment(settings.trajectories, seed)
        self.success = (success or Success()).check(self.env.task)
        sizes = self.env.observation_space.shape[1], self.env.action_space.shape[1]  # type: ignore[index]
        self.learner = make_learner(algorithm, *sizes, settings, demonstrations=demonstrations,
                                    seed=seed)  # fmt: skip
        if expert is not None:
            self.learner.adopt(expert)
        self.gate, self.seed, self.limit, self.report = gate, seed, steps, report
        self._expert, self._teacher = expert, demonstrations
        self.position, self.failure = gate.begin(), ""
        self.iterations: list[Iteration] = []
        self.trials: list[Trial] = []
        self._start, self._examination = time.monotonic(), None
        self._taken: float | None = None

    def _environment(self, n: int, seed: int) -> "RobotVectorEnv":
        """Makes simulations."""
        from revolver_lab.envs.vector import make_vec_env

        evolve, task, nthread = self._make
        return make_vec_env(evolve, n, task=task, seed=seed, nthread=nthread,
                            autoreset_mode="NextStep")  # fmt: skip

    @property
    def steps(self) -> int:
        """Returns the environment steps of training so far."""
        return self.iterations[-1].steps if self.iterations else 0

    @property
    def seconds(self) -> float:
        """Returns the time since the start, or the time it took [s]."""
        return time.monotonic() - self._start if self._taken is None else self._taken

    def rest(self) -> None:
        """Stops the clock, while others go on."""
        self._taken = self.seconds

    @property
    def resting(self) -> bool:
        """Whether its clock is stopped: nothing more will happen to it."""
        return self._taken is not None

    @property
    def over(self) -> bool:
        """Whether it has come to an end: by the gate, the budget or a failure."""
        spent = self.limit is not None and self.steps >= self.limit
        return self.position.done or spent or bool(self.failure)

    def iterate(self) -> Iteration:
        """Makes one iteration, and asks the gate."""
        alpha = self.position.alpha
        report = self.learner.iterate(self.env, self._draw, shaping=self.gate.shaping,
                                      success=self.success)  # fmt: skip
        steps = self.steps + report.steps
        self.position = self.gate.after(self.position, report.success, self._measure(steps))
        self.iterations.append(self._written(alpha, steps, report))
        if not report.finite:
            self.failure = "its numbers are no longer finite"
        if self.report is not None:
            self.report(self.iterations[-1])
        return self.iterations[-1]

    def _draw(self, simulation: int, rng: np.random.Generator) -> float:
        """Draws beta for a trajectory."""
        beta = self.gate.draw(self.position.alpha, rng)
        return self.env.evolve.nearest(beta) if self.gate.grid else beta

    def _written(self, alpha: float, steps: int, report: "IterationReport") -> Iteration:
        """Returns the record of an iteration."""
        average = self.position.average
        return Iteration(
            iteration=len(self.iterations), alpha=alpha, success=report.success,
            average=report.success if average is None else average,
            episode_return=float(report.returns.mean()), mean_beta=float(report.betas.mean()),
            kl=report.kl, log_std=report.log_std, explained=report.explained,
            steps=steps, wall_time=round(self.seconds, 3),
        )  # fmt: skip

    def _measure(self, steps: int) -> Callable[[float, int], float]:
        """Returns what the gate measures with."""
        return lambda alpha, episodes: self.examine(alpha, episodes, steps).success

    def examine(self, alpha: float, episodes: int, steps: int | None = None) -> Trial:
        """Plays episodes of the mean action on E(alpha), fresh ones every time.

        Args:
            alpha: The robot.
            episodes: How many, 1 or more.
            steps: Environment steps of training before; None is those of the log.
        """
        if self._examination is None:
            self._examination = self._environment(EXAMINED, 0)
        env, actor = self._examination, self.learner.actor
        # Trials are named by their number, so that a resumed run plays the same ones.
        name = np.random.SeedSequence(self.seed, spawn_key=(1, len(self.trials)))
        env.reset(seed=int(name.generate_state(1)[0]), options={"alpha": alpha})
        returns, successes = [], []
        while len(returns) < episodes:
            played = sample(env, lambda _, seen: actor.mean(seen), env.task.episode_steps)
            returns += map(float, played.returns)
            successes += map(bool, self.success(env, played))
        self.trials.append(Trial(
            steps=self.steps if steps is None else steps, alpha=alpha,
            iteration=self.learner.iterations, returns=tuple(returns[:episodes]),
            successes=tuple(successes[:episodes]),
        ))  # fmt: skip
        return self.trials[-1]

    def run(self, pause: Callable[[], bool] | None = None) -> bool:
        """Goes on until it is over, or until asked to pause.

        Args:
            pause: Asked before every iteration; True stops there.

        Returns:
            Whether it is over.
        """
        while not self.over:
            if pause is not None and pause():
                return False
            self.iterate()
        return True

    @property
    def _measured(self) -> Trial | None:
        """Returns the last evaluation of the policy as it is, None where there is none."""
        last = self.trials[-1] if self.trials else None
        return last if last and last.iteration == self.learner.iterations else None

    def result(self) -> NaturalLog:
        """Freezes what has happened so far."""
        name, last = self.env.evolve.name, self._measured
        at_target = tuple(trial for trial in self.trials if trial.alpha == 1.0)
        card = ModelCard(
            robot=name, alpha=last.alpha if last else self.position.alpha,
            algorithm=type(self.learner).__name__,
            steps=self.steps, seed=self.seed, episode_return=last.mean if last else None,
            versions=versions(), command=command(), commit=commit(), note=self.failure,
        )  # fmt: skip
        settings = {
            "gate": self.gate.to_json(), "learner": self.learner.settings.to_json(),
            "algorithm": card.algorithm, "success": dataclasses.asdict(self.success),
            "demonstrations": self._teacher.origin if self._teacher else None,
            "expert": self._expert.card.to_json() if self._expert else None,
            "versions": card.versions, "command": card.command, "commit": card.commit,
        }  # fmt: skip
        length = self.env.task.episode_steps
        return NaturalLog(
            robot=name, phases=phases_of(self.iterations, self.env.num_envs),
            evaluations=at_target, steps=self.steps,
            evaluation_steps=sum(trial.played for trial in self.trials) * length,
            wall_time=round(self.seconds, 3), failure=self.failure, seed=self.seed,
            reached_target=any(i.alpha == 1.0 for i in self.iterations), settings=settings,
            policy=self.learner.policy(card), iterations=tuple(self.iterations),
            trials=tuple(self.trials), finished=self.position.done,
        )  # fmt: skip

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that `restore` needs: arrays by name, and plain values."""
        parts = {"learner": self.learner.state(), "env": snapshot.take(self.env)}
        arrays = {f"{part}/{k}": v for part, (found, _) in parts.items() for k, v in found.items()}
        plain: dict[str, Any] = {part: values for part, (_, values) in parts.items()}
        records = {"iterations": self.iterations, "trials": self.trials}
        plain |= {k: [dataclasses.asdict(r) for r in some] for k, some in records.items()}
        return arrays, plain | {"position": dataclasses.asdict(self.position),
                                "failure": self.failure, "seconds": self.seconds}  # fmt: skip

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned; from there on, nothing is different."""
        parts = {part: {k.removeprefix(f"{part}/"): v for k, v in arrays.items()
                        if k.startswith(f"{part}/")} for part in ("learner", "env")}  # fmt: skip
        self.learner.restore(parts["learner"], plain["learner"])
        snapshot.put_back(self.env, parts["env"], plain["env"])
        self.position, self.failure = Position(**plain["position"]), plain["failure"]
        self.iterations = [Iteration(**record) for record in plain["iterations"]]
        self.trials = [Trial.from_json(record) for record in plain["trials"]]
        self._start = time.monotonic() - plain["seconds"]
