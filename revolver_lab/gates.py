"""Gates: alpha goes on when the policy succeeds often enough, and training ends when it is good."""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.given import is_number, is_whole, require, require_fields

Measure = Callable[[float, int], float]
"""Plays evaluations: (alpha, episodes) -> fraction of them that succeed, by mean actions."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Position:
    """Where a policy is on its path.

    Attributes:
        alpha: Evolution parameter.
        average: Moving average of the sampled success, or None before the first iteration.
        iterations: How many iterations there have been.
        done: Whether the gate's last demand is met.
    """

    alpha: float = 0.0
    average: float | None = None
    iterations: int = 0
    done: bool = False


@dataclasses.dataclass(frozen=True, kw_only=True)
class Gate:
    """What gates share: the window of beta, the step of alpha, and when to stop.

    Attributes:
        alpha_step: l_k in the paper, the step of alpha, or the largest one.
        xi: Width of the interval from which beta is drawn; 0 is the deterministic variant.
        shaping: h in the paper.
        alpha_start: Where alpha begins; 1 is direct transfer.
        every: Iterations between evaluations.
        finish: Success at alpha = 1 at which training ends.
        finish_episodes: Episodes of that evaluation.
        grid: Whether beta is the nearest of the 1,001 robots that are kept once compiled
            (appendix B); otherwise every trajectory compiles a robot of its own.
    """

    alpha_step: float = 0.01
    xi: float = 0.06
    shaping: float = 0.0
    alpha_start: float = 0.0
    every: int = 5
    finish: float = 0.9
    finish_episodes: int = 50
    grid: bool = True

    def __post_init__(self) -> None:
        """Refuses settings that cannot work."""
        self._require("alpha_step", 0, 1, least=False)
        self._require("shaping", -20, 20)
        for name in ("xi", "alpha_start", "finish"):
            self._require(name, 0, 1)
        for name in ("every", "finish_episodes"):
            self._require(name, 1, math.inf, whole=True)
        require("grid", self.grid, bool, "Leave it at True.")

    def _require(
        self, name: str, low: float, high: float, *, least: bool = True, whole: bool = False
    ) -> None:
        """Raises SettingsError unless a setting is a number within its bounds."""
        value = getattr(self, name)
        fits = (is_whole(value) if whole else is_number(value)) and low <= value <= high
        if not fits or (value == low and not least):
            allowed = f"a {'whole ' * whole}number in {'[' if least else '('}{low}, {high}]"
            raise SettingsError(f"{name} = {value!r}", allowed, f"Try {type(self).__name__}().")

    def begin(self) -> Position:
        """Returns where the path begins."""
        return Position(alpha=float(self.alpha_start))

    def draw(self, alpha: float, rng: np.random.Generator) -> float:
        """Draws beta ~ Uniform(alpha, min(alpha + xi, 1)) (Algorithm 1, line 14)."""
        return float(rng.uniform(alpha, min(alpha + self.xi, 1.0)))

    def after(self, position: Position, success: float, measure: Measure) -> Position:
        """Returns the position after an iteration.

        Args:
            position: The position it was made at.
            success: Fraction of its trajectories that succeeded, actions sampled.
            measure: Plays evaluations, if need be.
        """
        raise NotImplementedError

    def to_json(self) -> dict[str, Any]:
        """Returns the gate as plain JSON values, its kind included."""
        return {"gate": type(self).__name__, **dataclasses.asdict(self)}


@dataclasses.dataclass(frozen=True, kw_only=True)
class SampledGate(Gate):
    """Alpha goes on by the training's own sampled success, which costs nothing.

    alpha += l clip((min(average, last + slack) - low) / (high - low), 0, 1), where the average
    moves by `weight` of the last success (facts, section 8). At alpha = 1, once the average is
    `high`, an evaluation ends it, or two: who asks often is told yes by luck in the end.

    Attributes:
        low: Success at or below which alpha stays.
        high: Success from which on alpha takes its largest step.
        weight: Of the last success in the average.
        slack: How far the average may be above the last success.
        confirm_episodes: Episodes of the second evaluation; 0 takes the first at its word.
        confirm: Success at which it confirms.
    """

    alpha_step: float = 0.03
    finish: float = 0.98
    low: float = 0.4
    high: float = 0.8
    weight: float = 0.3
    slack: float = 0.1
    confirm_episodes: int = 0
    confirm: float = 0.95

    def __post_init__(self) -> None:
        """Refuses settings that cannot work."""
        super().__post_init__()
        for name in ("low", "high", "slack", "confirm"):
            self._require(name, 0, 1)
        self._require("confirm_episodes", 0, math.inf, whole=True)
        self._require("weight", 0, 1, least=False)
        if self.low >= self.high:
            raise SettingsError(f"low = {self.low} with high = {self.high}", "low < high",
                                "The pilot used 0.4 and 0.8.")  # fmt: skip

    def after(self, position: Position, success: float, measure: Measure) -> Position:
        """Returns the position after an iteration; see the class.

        Example:
            >>> gate = SampledGate(alpha_step=0.02, low=0.5, high=0.9)
            >>> gate.after(Position(alpha=0.3), 0.7, lambda alpha, episodes: 0.0).alpha
            0.31
        """
        last = success if position.average is None else position.average
        average = last + self.weight * (success - last)
        iterations, done = position.iterations + 1, False
        trust = (min(average, success + self.slack) - self.low) / (self.high - self.low)
        alpha = _onward(position.alpha, self._length(min(max(trust, 0.0), 1.0)))
        if position.alpha == 1.0 and average >= self.high and iterations % self.every == 0:
            done = self._content(measure)
        return Position(alpha=alpha, average=average, iterations=iterations, done=done)

    def _content(self, measure: Measure) -> bool:
        """Whether training may end."""
        first, again = measure(1.0, self.finish_episodes) >= self.finish, self.confirm_episodes
        return first and (not again or measure(1.0, again) >= self.confirm)

    def to_json(self) -> dict[str, Any]:
        """Returns the gate as plain JSON values; a second evaluation only where there is one."""
        plain = super().to_json()  # folders are named by a hash of it, and older ones have none
        if not self.confirm_episodes:
            del plain["confirm_episodes"], plain["confirm"]
        return plain

    def _length(self, trust: float) -> float:
        """Returns the step of alpha for a trust in [0, 1]."""
        return self.alpha_step * trust


@dataclasses.dataclass(frozen=True, kw_only=True)
class SteppedGate(SampledGate):
    """The path in equal jumps: alpha waits until the usual gate would take its largest step.

    Example:
        >>> gate = SteppedGate(alpha_step=0.25)
        >>> [gate.after(Position(), success, lambda alpha, n: 0.0).alpha for success in (0.7, 0.8)]
        [0.0, 0.25]
    """

    def _length(self, trust: float) -> float:
        """Returns the whole step, or none."""
        return self.alpha_step if trust == 1.0 else 0.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class EvaluatedGate(Gate):
    """The rule of the published runs (facts, section 3): alpha goes on after an evaluation.

    Every five iterations alpha goes on if half of twenty episodes succeed; at 1, 0.9 of 50 end it.

    Attributes:
        threshold: Success at which alpha goes on.
        episodes: Episodes of an evaluation.
    """

    threshold: float = 0.5
    episodes: int = 20

    def __post_init__(self) -> None:
        """Refuses settings that cannot work."""
        super().__post_init__()
        self._require("threshold", 0, 1)
        self._require("episodes", 1, math.inf, whole=True)

    def after(self, position: Position, success: float, measure: Measure) -> Position:
        """Returns the position after an iteration; see the class."""
        alpha, done, iterations = position.alpha, False, position.iterations + 1
        if iterations % self.every == 0:
            if alpha == 1.0:
                done = measure(1.0, self.finish_episodes) >= self.finish
            elif measure(alpha, self.episodes) >= self.threshold:
                alpha = _onward(alpha, self.alpha_step)
        return Position(alpha=alpha, average=success, iterations=iterations, done=done)


def _onward(alpha: float, step: float) -> float:
    """Returns alpha a step further, 1 at most, and without the dust of adding."""
    further = round(alpha + step, 12)
    return further if further < 1 - 1e-9 else 1.0  # 2,000 roundings may leave so much to go


GATES = {gate.__name__: gate for gate in (SampledGate, SteppedGate, EvaluatedGate)}


def gate_from_json(value: Mapping[str, Any]) -> Gate:
    """Reads a gate back.

    Raises:
        SettingsError: If there is no gate of that kind, or it has other fields.

    Example:
        >>> gate_from_json(EvaluatedGate(episodes=10).to_json()).episodes
        10
    """
    require("a gate", value, Mapping, "See Gate.to_json().")
    name, fields = value.get("gate"), {key: value[key] for key in value if key != "gate"}
    if (kind := GATES.get(str(name))) is None:
        raise SettingsError(f"gate = {name!r}", f"one of {[*GATES]}", "Take one.")
    require_fields(kind.__name__, fields, kind)
    return kind(**fields)


PILOT_GATE = SampledGate()
"""Run 2 of the pilot: steps of 0.03 at most, between a sampled success of 0.4 and 0.8."""
PUBLISHED_GATE = EvaluatedGate(shaping=1.0)
"""The published runs of the hand: steps of 0.01, xi = 0.06, h = 1."""
