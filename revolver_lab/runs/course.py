"""What each notebook compares: recorded results to read, or the same rows to train."""

import dataclasses
import difflib
import functools
import importlib.util
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from revolver_lab.errors import MissingExtraError, SettingsError, UnknownNameError
from revolver_lab.robots import registry
from revolver_lab.runs.lesson_plans import fast_plan, is_natural, live_plan
from revolver_lab.runs.plan import Plan
from revolver_lab.runs.recordings import recorded
from revolver_lab.runs.results import Results
from revolver_lab.runs.run import ROOT, Run

MODE = "REVOLVER_LAB_MODE"
"""Environment variable that chooses the mode where the notebook does not."""

MODES: Mapping[str, str] = {
    "recorded": "what was trained before is read; nothing is trained here",
    "live": "they are trained here, in a few minutes on two cores",
    "fast": "a few steps show that everything works; the returns mean nothing",
}

PAIRS = ("cheetah-front-leg", "cheetah-short-legs", "cheetah-long-legs", "cheetah-segment",
         "ball-in-cup-weak-motors")  # fmt: skip
"""The pairs at course scale; what is trained here is trained on the first."""

HANDS = ("adroit-door", "adroit-door-fingers", "adroit-hammer", "adroit-relocate-fingers")
"""The hand's pairs, five fingers to two; what is trained here is trained on the first."""

OTHER_EXPERT = "a6eed311842b7c71f571a8ebd1d0ce530f072436662803f04d2b27fcde609911"
"""Hash of another expert of the cheetahs, equally good at home: trained by the stacked engine, and
at a slower rate at the end. Runs with it are recorded on the first pair; it is not shipped."""

_MEASURED = PAIRS[:4]
"""The pairs on which equal data, the critic and the cleaning were recorded."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Subject:
    """The rows of a lesson.

    Attributes:
        methods: What is compared.
        seeds: Seeds of each where it is trained live; recorded runs have more.
        robots: Where it was recorded; live it is trained on the first.
    """

    methods: tuple[str, ...]
    seeds: int
    robots: tuple[str, ...] = PAIRS


LESSONS: Mapping[str, Subject] = {
    "02_why_direct_transfer_fails": Subject(methods=("scratch", "direct", "revolver"), seeds=5),
    "03_one_step_of_evolution": Subject(
        methods=("revolver", "short-phases", "quick", "quick-short-phases", "quarter-phases"),
        seeds=4, robots=PAIRS[:1],
    ),
    "04_deterministic_or_randomised": Subject(
        methods=("deterministic", "revolver", "deterministic-equal", "revolver-equal"), seeds=5,
        robots=_MEASURED,
    ),
    "05_what_h_does": Subject(
        methods=("revolver", "revolver-h1", "revolver-h1-relative", "revolver-h1-normalised",
                 "revolver-h3", "revolver-h8-normalised"), seeds=4, robots=PAIRS[:1],
    ),
    "06_what_must_be_carried": Subject(
        methods=("revolver", "critic-reset", "no-cleaning", "window-0.33", "optimiser-fresh"),
        seeds=4, robots=_MEASURED,
    ),
    "07_limbs_that_grow": Subject(
        methods=("soil-scratch", "soil", "npg-direct", "npg-revolver"), seeds=1,
        robots=("cheetah-segment",),
    ),
    "08_five_fingers_to_two": Subject(
        methods=("npg-direct", "npg-revolver"), seeds=1, robots=HANDS
    ),
}  # fmt: skip
"""Notebook -> what it compares."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Lesson:
    """One notebook's rows, in one mode.

    Attributes:
        name: The notebook's.
        mode: One of `MODES`.
        folder: Where recorded runs are; None is those that are shipped.
    """

    name: str
    mode: str
    folder: Path | None = None

    @property
    def robots(self) -> tuple[str, ...]:
        """Returns the pairs of robots with recorded rows; the first is the one trained here."""
        return LESSONS[self.name].robots

    @property
    def methods(self) -> tuple[str, ...]:
        """Returns the names of the rows."""
        return LESSONS[self.name].methods

    @property
    def plan(self) -> Plan | None:
        """Returns what is trained here; None where recorded results are read."""
        if self.mode == "recorded":
            return None
        if self.mode == "fast":
            return fast_plan(self.robots[0], self.methods)
        return live_plan(self.robots[0], self.methods, LESSONS[self.name].seeds)

    @functools.cached_property
    def run(self) -> Run | None:
        """Returns the run that trains the rows here, not yet started; None where none does."""
        plan = self.plan
        if plan is None:
            return None
        return Run(plan, root=self._scratch.name if self.mode == "fast" else ROOT)

    @functools.cached_property
    def _scratch(self) -> "tempfile.TemporaryDirectory[str]":
        """A folder that goes when the lesson does."""
        return tempfile.TemporaryDirectory(prefix="revolver-lab-", ignore_cleanup_errors=True)

    def results(self) -> Results:
        """Returns the rows of this mode: trained here, which is waited for, or recorded.

        Raises:
            SettingsError: If a worker failed, or a row was not recorded.
        """
        return self.recorded() if self.run is None else self.run.start().wait()

    def recorded(
        self, robot: str | None = None, methods: Sequence[str] | None = None,
        task: str | None = None, expert: str | None = None,
    ) -> Results:  # fmt: skip
        """Returns recorded rows, in every mode.

        Args:
            robot: One of `robots`; None is the first.
            methods: Other rows than those of the lesson.
            task: The reward, by its name; None is the robot's first.
            expert: Hash of the expert's weights; None is the shipped one.

        Raises:
            SettingsError: If nothing is recorded, or a row is not.
        """
        robot = robot or self.robots[0]
        settings = {"task": task or registry.get(robot).usual_task}
        settings |= {"expert": expert} if expert else {}
        rows = methods or self.methods
        return recorded(robot, rows, folder=self.folder, settings=settings,
                        natural=is_natural(rows))  # fmt: skip

    def __str__(self) -> str:
        """Says what happens in this mode, and how to change it."""
        plan = self.plan
        seeds = "" if plan is None else f", {len(plan.seeds)} seeds each"
        other = "live" if self.mode == "recorded" else "recorded"
        return (f"{self.robots[0]}: {', '.join(self.methods)}{seeds}.\n"
                f"Mode {self.mode}: {MODES[self.mode]}.\n"
                f'For another mode: rvl.lab.lesson("{self.name}", "{other}").')  # fmt: skip


def lesson(name: str, mode: str | None = None, *, folder: Path | None = None) -> Lesson:
    """Returns the rows of a notebook; nothing is trained or read yet.

    Args:
        name: One of `LESSONS`, the notebook's file name.
        mode: "recorded", "live" or "fast"; None takes it from the environment variable
            REVOLVER_LAB_MODE, and "recorded" where that is not set.
        folder: Where recorded runs are; None is those that are shipped.

    Raises:
        UnknownNameError: If there is no such lesson.
        SettingsError: If there is no such mode.
        MissingExtraError: If something is to be trained and torch is not installed.

    Example:
        >>> lesson("04_deterministic_or_randomised", "recorded").run is None
        True
        >>> lesson("04_deterministic_or_randomised", "recorded").methods[:2]
        ('deterministic', 'revolver')
    """
    known = _checked_name(name)
    without = is_natural(LESSONS[known].methods)
    return Lesson(name=known, mode=_checked_mode(mode, without), folder=folder)


def _checked_name(name: str) -> str:
    """Returns the name of a lesson; near ones are listed first where there is none."""
    if not isinstance(name, str) or name not in LESSONS:
        near = difflib.get_close_matches(str(name), LESSONS, n=3, cutoff=0.3)
        remedy = f"Did you mean {' or '.join(map(repr, near))}?" if near else "Choose one of these."
        raise UnknownNameError(f"lesson {name!r}", ", ".join(LESSONS), remedy)
    return name


def _checked_mode(mode: str | None, without: bool) -> str:
    """Returns the mode, from the environment where none is given.

    Args:
        mode: What was asked for.
        without: Whether it can be trained without torch.
    """
    given = mode if mode is not None else os.environ.get(MODE) or "recorded"
    source = "mode" if mode is not None else MODE
    if given not in MODES:
        raise SettingsError(f"{source} = {given!r}", f"one of {tuple(MODES)}",
                            '"recorded" trains nothing.')  # fmt: skip
    if given != "recorded" and not without and importlib.util.find_spec("torch") is None:
        raise MissingExtraError(
            f"{source} = {given!r} without torch", "torch and stable-baselines3",
            "Install them: pip install 'revolver-lab[train]'. Or read: \"recorded\".",
        )  # fmt: skip
    return given
