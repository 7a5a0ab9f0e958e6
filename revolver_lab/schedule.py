"""The schedule of Algorithm 1: which robots a phase draws, and when the next phase begins."""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.given import is_number, is_whole
from revolver_lab.shaping import FORMS


def _require(holds: bool, given: str, allowed: str, remedy: str) -> None:
    """Raises SettingsError unless the condition holds."""
    if not holds:
        raise SettingsError(given, allowed, remedy)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Adaptive:
    """The paper's adaptive schedule: a phase that struggles gets more episodes (section 4.4).

    Attributes:
        ratio: A phase is good enough when its latest episodes return at least this fraction of
            what the previous phases returned at their end.
        memory: How many previous phases are averaged for that comparison.
        episodes_limit: After this many episodes a phase ends however poor it is.
    """

    ratio: float = 0.7
    memory: int = 3
    episodes_limit: int = 200

    def __post_init__(self) -> None:
        """Refuses settings that cannot work."""
        _require(is_number(self.ratio) and 0 < self.ratio <= 1, f"ratio = {self.ratio!r}",
                 "a fraction in (0, 1]", "Try 0.7.")  # fmt: skip
        for name, usual in (("memory", 3), ("episodes_limit", 200)):
            value = getattr(self, name)
            _require(is_whole(value, 1), f"{name} = {value!r}", "a whole number, 1 or more",
                     f"Try {usual}.")  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True)
class Schedule:
    """The path of alpha and the window of beta around it (Algorithm 1, lines 6 to 14 and 29).

    A schedule knows no environment and no learner: it says which beta to draw, what to keep
    in the replay and when a phase is over.

    Attributes:
        alpha_step: l_k in the paper, the progress of alpha from one phase to the next.
        xi: Width of the interval from which beta is drawn; 0 is the deterministic variant.
        episodes_per_phase: N_e in the paper, episodes a phase, over all simulations together.
        final_episodes: Episodes of the last phase, at alpha = 1; None is `episodes_per_phase`.
        shaping: h in the paper; rewards are multiplied by exp(h beta) when they are sampled.
        shaping_form: "absolute" as in the paper, "relative" exp(h (beta - alpha)), or
            "normalised" to a mean of one over the phase; see `revolver_lab.shaping`.
        window: Width of the interval of beta, ending at alpha + xi, that survives the cleaning
            of the replay; None is xi, the paper's [alpha, alpha + xi]; infinity keeps all.
        latest: Transitions that survive a cleaning at most, the latest; None keeps all of the
            window. With an infinite window it holds the amount of data equal between methods.
        phase_steps: Environment steps a phase, in place of `episodes_per_phase`; the last phase
            too, unless `final_episodes` is given. None counts episodes, as the paper does.
        short_phases: Whether a phase may be shorter than an episode, to see it fail.
        adaptive: None for a fixed schedule.
        alpha_start: Where alpha begins; 1 leaves the last phase only, which is direct transfer.
        alpha_end: Where alpha ends, exactly; 0 stays on the source, which trains an expert.

    Example:
        >>> schedule = Schedule(alpha_step=0.4, xi=0.5, episodes_per_phase=8)
        >>> schedule.alphas
        (0.0, 0.4, 0.8, 1.0)
        >>> 0.8 <= schedule.draw(0.8, np.random.default_rng(0)) <= 1.0
        True
    """

    alpha_step: float = 0.04
    xi: float = 0.12
    episodes_per_phase: int = 8
    final_episodes: int | None = None
    shaping: float = 0.0
    shaping_form: str = "absolute"
    window: float | None = None
    latest: int | None = None
    phase_steps: int | None = None
    short_phases: bool = False
    adaptive: Adaptive | None = None
    alpha_start: float = 0.0
    alpha_end: float = 1.0

    def __post_init__(self) -> None:
        """Refuses settings that cannot work, before the first step."""
        for name in ("alpha_step", "xi", "shaping", "alpha_start", "alpha_end"):
            value = getattr(self, name)
            _require(is_number(value), f"{name} = {value!r}", "a finite number", "Convert it.")
        limitless = self.window in (None, math.inf)
        _require(limitless or is_number(self.window), f"window = {self.window!r}",
                 "None, a number, or infinity", "Convert it.")  # fmt: skip
        _require(isinstance(self.short_phases, bool), f"short_phases = {self.short_phases!r}",
                 "True or False", "Leave it out.")  # fmt: skip
        _require(isinstance(self.adaptive, Adaptive | None), f"adaptive = {self.adaptive!r}",
                 "Adaptive(...), or None", "Leave it out.")  # fmt: skip
        _require(0 < self.alpha_step <= 1, f"alpha_step = {self.alpha_step}",
                 "a number in (0, 1]", "The course uses 0.04.")  # fmt: skip
        _require(self.xi == 0 or self.alpha_step < self.xi <= 1,
                 f"xi = {self.xi} with alpha_step = {self.alpha_step}",
                 "0 (deterministic), or a number in (alpha_step, 1], as the paper's l_k < xi",
                 "Raise xi or lower alpha_step.")  # fmt: skip
        _require(0 <= self.alpha_start <= self.alpha_end <= 1,
                 f"alpha from {self.alpha_start} to {self.alpha_end}",
                 "0 <= alpha_start <= alpha_end <= 1", "Leave them at 0 and 1.")  # fmt: skip
        _require(abs(self.shaping) <= 20, f"shaping = {self.shaping}", "a number in [-20, 20]",
                 "The paper uses h = 1; 0 turns it off.")  # fmt: skip
        _require(self.window is None or self.window >= self.xi,
                 f"window = {self.window} with xi = {self.xi}", "None, or xi and more",
                 "A narrower window would drop the robots being drawn.")  # fmt: skip
        _require(self.shaping_form in FORMS, f"shaping_form = {self.shaping_form!r}",
                 f"one of {FORMS}", "The paper's is 'absolute'.")  # fmt: skip
        self._require_episodes()

    def _require_episodes(self) -> None:
        """Refuses numbers of episodes that no phase can have."""
        for name in ("episodes_per_phase", "final_episodes", "latest", "phase_steps"):
            value = getattr(self, name)
            optional = name != "episodes_per_phase" and value is None
            _require(optional or is_whole(value, 1), f"{name} = {value!r}",
                     "a whole number, 1 or more", "Try 8.")  # fmt: skip
        limit = self.adaptive.episodes_limit if self.adaptive else math.inf
        _require(limit >= self.episodes_per_phase, f"episodes_limit = {limit}",
                 f"episodes_per_phase = {self.episodes_per_phase} or more",
                 "Raise the limit of the adaptive schedule.")  # fmt: skip

    def to_json(self) -> dict[str, Any]:
        """Returns the schedule as plain JSON values; an infinite window is the string "inf"."""
        plain = dataclasses.asdict(self)
        return plain | ({"window": "inf"} if self.window == math.inf else {})

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Schedule":
        """Reads a schedule back.

        Example:
            >>> schedule = Schedule(window=math.inf, adaptive=Adaptive())
            >>> Schedule.from_json(schedule.to_json()) == schedule
            True
        """
        adaptive, window = value.get("adaptive"), value.get("window")
        read = {"adaptive": Adaptive(**adaptive) if adaptive else None,
                "window": None if window is None else float(window)}  # fmt: skip
        return cls(**{**value, **read})

    @functools.cached_property
    def alphas(self) -> tuple[float, ...]:
        """Returns alpha of every phase: alpha_k = sum of l_i (section 4.2), the last exact."""
        count = math.ceil((self.alpha_end - self.alpha_start) / self.alpha_step - 1e-9)
        before = (self.alpha_start + k * self.alpha_step for k in range(count))
        return (*(round(alpha, 12) for alpha in before), float(self.alpha_end))

    def draw(self, alpha: float, rng: np.random.Generator) -> float:
        """Draws beta ~ Uniform(alpha, min(alpha + xi, 1)) (Algorithm 1, line 14).

        Args:
            alpha: Alpha of the phase, in [0, 1].
            rng: The stream that beta is drawn from.
        """
        return float(rng.uniform(alpha, min(alpha + self.xi, 1.0)))

    def kept(self, alpha: float) -> tuple[float, float]:
        """Returns the interval of beta that survives the cleaning at alpha (line 31)."""
        width = self.xi if self.window is None else self.window
        return alpha - (width - self.xi), alpha + self.xi

    def episodes(self, alpha: float) -> int:
        """Returns how many episodes the phase at alpha has, at the least."""
        if alpha == self.alpha_end and self.final_episodes is not None:
            return self.final_episodes
        return self.episodes_per_phase

    def counts_steps(self, alpha: float) -> bool:
        """Says whether the phase at alpha ends after steps, not after episodes."""
        last = alpha == self.alpha_end and self.final_episodes is not None
        return self.phase_steps is not None and not last

    def phase_over(
        self, alpha: float, returns: Sequence[float], previous: Sequence[float], steps: int = 0
    ) -> bool:
        """Says whether the phase at alpha has run long enough (line 12, and section 4.4).

        Args:
            alpha: Alpha of the phase.
            returns: Unshaped returns of the episodes this phase has finished, in order.
            previous: What each earlier phase returned at its end, in order.
            steps: Environment steps of this phase.
        """
        if self.counts_steps(alpha):
            return steps >= (self.phase_steps or 0)
        least = self.episodes(alpha)
        if len(returns) < least:
            return False
        if self.adaptive is None or not previous or len(returns) >= self.adaptive.episodes_limit:
            return True
        reference = float(np.mean(previous[-self.adaptive.memory :]))
        allowed_drop = (1 - self.adaptive.ratio) * abs(reference)
        return float(np.mean(returns[-least:])) >= reference - allowed_drop

    def check(self, simulations: int, episode_steps: int) -> None:
        """Refuses a phase that is shorter than an episode of every simulation.

        beta is redrawn only when an episode ends: with a shorter phase some simulations would
        still run robots of the phase before, and cleaning would drop what they bring.

        Args:
            simulations: Number of simulations that share the phase.
            episode_steps: Steps of an episode that does not end early [steps].

        Raises:
            SettingsError: If fewer episodes than simulations make a phase.
        """
        if self.short_phases:
            return
        remedy = "such a phase is shorter than an episode. To watch it fail: short_phases=True."
        if self.phase_steps is not None:
            least = simulations * episode_steps
            _require(self.phase_steps >= least, f"phase_steps = {self.phase_steps}",
                     f"{least} or more, {episode_steps} for each of {simulations} simulations",
                     f"Raise phase_steps or use fewer simulations: {remedy}")  # fmt: skip
            return
        shortest = min(self.episodes(alpha) for alpha in {self.alpha_start, self.alpha_end})
        _require(shortest >= simulations, f"a phase of {shortest} episodes",
                 f"{simulations} or more, one for each of {simulations} simulations",
                 f"Raise episodes_per_phase or use fewer simulations: {remedy}")  # fmt: skip
