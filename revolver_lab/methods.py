"""What the paper compares, each a configuration of the one loop in `algorithm1`."""

import dataclasses
import difflib
import math
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from revolver_lab.errors import SettingsError, UnknownNameError
from revolver_lab.given import require
from revolver_lab.schedule import Adaptive, Schedule

Row = TypeVar("Row")

CRITICS = ("carried", "reset")
OPTIMISERS = ("kept", "fresh")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Method:
    """A way of getting a policy for the target robot.

    Attributes:
        name: Its name.
        schedule: The path of alpha.
        expert: Whether the expert is carried over; otherwise learning starts from scratch.
        critic: Whether the expert's critic is "carried" along with its actor, or "reset".
        optimiser: Whether Adam's moments are "kept" from one phase to the next, or "fresh" in
            each; every transfer begins with fresh ones.
    """

    name: str
    schedule: Schedule
    expert: bool = True
    critic: str = "carried"
    optimiser: str = "kept"

    def __post_init__(self) -> None:
        """Refuses what no method can be."""
        require("name", self.name, str, "Try 'mine'.")
        require("schedule", self.schedule, Schedule, "Pass rvl.Schedule().")
        require("expert", self.expert, bool, "True carries the expert over.")
        for name, choices in (("critic", CRITICS), ("optimiser", OPTIMISERS)):
            if getattr(self, name) not in choices:
                raise SettingsError(f"{name} = {getattr(self, name)!r}", f"one of {choices}",
                                    "Take the first.")  # fmt: skip

    @property
    def needs_expert(self) -> bool:
        """Whether there has to be an expert, to begin with."""
        return self.expert

    def to_json(self) -> dict[str, Any]:
        """Returns the method as plain JSON values."""
        plain = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return plain | {"schedule": self.schedule.to_json()}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Method":
        """Reads a method back."""
        return cls(**{**value, "schedule": Schedule.from_json(value["schedule"])})


@dataclasses.dataclass(frozen=True, kw_only=True)
class Member:
    """One learner of a population: a method and a seed.

    Attributes:
        method: How it learns; a `Method`, or a `NaturalMethod` for the loop that takes those.
        seed: Seed of everything random about it, in whatever company it learns.
    """

    method: Any
    seed: int

    @property
    def name(self) -> str:
        """Returns a name for files: "revolver-3"."""
        return f"{self.method.name}-{self.seed}"


# 360 episodes each, 72,000 steps of a cheetah: the path takes 25 phases of 8, alpha = 1 the rest.
_PATH = Schedule(episodes_per_phase=8, final_episodes=160)
_TARGET_ONLY = Schedule(alpha_start=1.0, final_episodes=360)
_EPISODE_STEPS = 200
_ONE_PHASE = 8 * _EPISODE_STEPS  # transitions that one phase of a cheetah collects
_LONG = {"alpha_step": 0.08, "episodes_per_phase": 16, "final_episodes": 152}


def _path(**changes: object) -> Schedule:
    """Returns the path of the course with some fields changed."""
    return dataclasses.replace(_PATH, **changes)  # type: ignore[arg-type]


def _short(alpha_step: float, parts: int, final_episodes: int) -> Schedule:
    """Returns a path whose phases are a part of an episode of every simulation."""
    return _path(alpha_step=alpha_step, episodes_per_phase=8 // parts, short_phases=True,
                 phase_steps=_ONE_PHASE // parts, final_episodes=final_episodes)  # fmt: skip


_ROWS = (
    Method(name="scratch", schedule=_TARGET_ONLY, expert=False),
    Method(name="direct", schedule=_TARGET_ONLY),
    Method(name="deterministic", schedule=_path(xi=0.0)),
    Method(name="revolver", schedule=_PATH),
    Method(name="adaptive", schedule=_path(adaptive=Adaptive(episodes_limit=16))),
    # Randomised or deterministic, with the data that a cleaning leaves held equal.
    Method(name="deterministic-equal",
           schedule=_path(xi=0.0, window=math.inf, latest=_ONE_PHASE)),
    Method(name="revolver-equal", schedule=_path(window=math.inf, latest=_ONE_PHASE)),
    *(Method(name=f"xi-{xi:g}-equal", schedule=_path(xi=xi, window=math.inf, latest=_ONE_PHASE))
      for xi in (0.06, 0.3)),
    # Half as many phases, each twice as long and as far.
    Method(name="deterministic-long", schedule=_path(xi=0.0, **_LONG)),
    Method(name="revolver-long", schedule=_path(**_LONG)),
    # Phases of half an episode, at the usual pace and at twice the pace; the latter with whole
    # episodes too, so that short can be told from quick; and phases of a quarter.
    Method(name="short-phases", schedule=_short(0.02, 2, 160)),
    Method(name="quick", schedule=_path(alpha_step=0.08, final_episodes=256)),
    Method(name="quick-short-phases", schedule=_short(0.04, 2, 260)),
    Method(name="quarter-phases", schedule=_short(0.04, 4, 310)),
    # Shaping: the paper's form, and the two that keep the size of the reward.
    Method(name="revolver-h1", schedule=_path(shaping=1.0)),
    Method(name="revolver-h1-relative", schedule=_path(shaping=1.0, shaping_form="relative")),
    Method(name="revolver-h1-normalised", schedule=_path(shaping=1.0, shaping_form="normalised")),
    Method(name="revolver-h8-normalised", schedule=_path(shaping=8.0, shaping_form="normalised")),
    Method(name="revolver-h3", schedule=_path(shaping=3.0)),
    # What is carried.
    Method(name="critic-reset", schedule=_PATH, critic="reset"),
    Method(name="no-cleaning", schedule=_path(window=math.inf)),
    Method(name="window-0.33", schedule=_path(window=0.33)),
    Method(name="optimiser-fresh", schedule=_PATH, optimiser="fresh"),
)  # fmt: skip

METHODS: Mapping[str, Method] = {row.name: row for row in _ROWS}
"""Every method at course scale, by name."""


def fitted(method: Method, episode_steps: int) -> Method:
    """Returns a method of the table for a task whose episodes have another length.

    The table is written for episodes of 200 steps. Where they are shorter, a phase has more of
    them, so that it takes as many steps; where they are longer, one a simulation is the least.

    Args:
        method: One of `METHODS`.
        episode_steps: Steps of an episode that does not end early [steps].

    Example:
        >>> fitted(METHODS["revolver"], 100).schedule.episodes_per_phase
        16
    """
    schedule, factor = method.schedule, max(_EPISODE_STEPS / episode_steps, 1.0)
    episodes = {name: round(factor * getattr(schedule, name))
                for name in ("episodes_per_phase", "final_episodes")
                if getattr(schedule, name) is not None}  # fmt: skip
    adaptive = schedule.adaptive
    if adaptive is not None:
        limit = round(factor * adaptive.episodes_limit)
        adaptive = dataclasses.replace(adaptive, episodes_limit=limit)
    changed = dataclasses.replace(schedule, adaptive=adaptive, **episodes)
    return dataclasses.replace(method, schedule=changed)


def method(name: str) -> Method:
    """Returns a method by name.

    Raises:
        UnknownNameError: If there is none of that name; near ones are listed first.

    Example:
        >>> method("direct").schedule.alphas
        (1.0,)
    """
    return look_up(name, METHODS)


def look_up(name: str, table: Mapping[str, Row]) -> Row:
    """Returns a row of a table by name.

    Args:
        name: Of a method.
        table: Such as `METHODS`.

    Raises:
        UnknownNameError: If there is none of that name; near ones are suggested.
    """
    if not isinstance(name, str) or name not in table:
        near = difflib.get_close_matches(str(name), table, n=3, cutoff=0.4)
        remedy = f"Did you mean {' or '.join(map(repr, near))}?" if near else "Choose one of these."
        raise UnknownNameError(f"method {name!r}", ", ".join(table), remedy)
    return table[name]


def members(methods: Iterable[Any], seeds: Iterable[int]) -> tuple[Member, ...]:
    """Returns every method with every seed.

    Args:
        methods: Methods, or names of them.
        seeds: Whole numbers of 0 and more.

    Raises:
        SettingsError: If there are none, or two are alike.

    Example:
        >>> [member.name for member in members(["direct", "revolver"], range(2))]
        ['direct-0', 'direct-1', 'revolver-0', 'revolver-1']
    """
    chosen = [method(m) if isinstance(m, str) else m for m in methods]
    found = tuple(Member(method=m, seed=int(seed)) for m in chosen for seed in [*seeds])
    names = [member.name for member in found]
    if not found or len(set(names)) < len(names) or min(m.seed for m in found) < 0:
        raise SettingsError(f"learners {names}", "one or more, each with a name of its own and a "
                            "seed of 0 or more", "Give every method its own name.")  # fmt: skip
    return found
