"""What the figures of results share: colours, words for intervals, and a foot with the cost."""

import textwrap
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError
from revolver_lab.stats import Band, Cost, Interval
from revolver_lab.stats.checks import numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, GRID = "#3b4252", "#e5e9f0"
# Okabe and Ito's colours, which the colour-blind tell apart; without the yellow, pale on white.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DASHES = ("-", "--", ":", "-.")
WIDTH = 8.4
"""Inches; about as wide as a notebook."""
_COLUMNS = 140
_FEW = 40
"""Points that are marked one by one; a line through more stands for itself."""
ONE_SEED = "One seed alone has no interval: it says nothing about others."

Value = TypeVar("Value")


def colour(rank: int) -> str:
    """Colour of the method of this rank."""
    return COLOURS[rank % len(COLOURS)]


def dashes(rank: int) -> str:
    """Line style of the method of this rank; where lines coincide, the gaps show what is below."""
    return DASHES[rank % len(DASHES)]


def checked(given: Mapping[str, Value], cost: Cost) -> Mapping[str, Value]:
    """Returns what is to be drawn.

    Args:
        given: Name -> results.
        cost: What the figure cost.

    Raises:
        SettingsError: If there is nothing to draw, names are no words, or the cost is missing.
    """
    if not isinstance(given, Mapping) or not given:
        raise SettingsError(f"results of type {type(given).__name__} for no method",
                            "name -> results, one or more", "Name each method.")  # fmt: skip
    nameless = [name for name in given if not isinstance(name, str) or not name.strip()]
    if nameless:
        raise SettingsError(f"a method named {nameless[0]!r}", "a word", "Name it for the reader.")
    if not isinstance(cost, Cost):
        raise SettingsError(f"cost = {cost!r}", "a Cost", "Pass rvl.stats.Cost(steps=..., "
                            "seconds=...), all methods and seeds together.")  # fmt: skip
    return given


def axis(given: ArrayLike, name: str) -> np.ndarray:
    """Returns what stands along an axis, (K,).

    Args:
        given: Increasing numbers.
        name: What to call them in an error.

    Raises:
        SettingsError: If they are no increasing numbers.
    """
    at = numbers(given, name)
    if at.ndim != 1 or (np.diff(at) <= 0).any():
        raise SettingsError(f"{name} of shape {at.shape}", "(K,), increasing", "Sort them.")
    return at


def figure_and_axes(height: float, title: str, xlabel: str, ylabel: str) -> "tuple[Figure, Axes]":
    """Returns an empty figure, outside pyplot, and its axes.

    Args:
        height: In inches.
        title: Above it, on the left; may be empty.
        xlabel: Below the axis.
        ylabel: Beside the axis.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots()
    axes.set_title(title, loc="left", fontsize=12, color=INK)
    axes.set_xlabel(xlabel, color=INK)
    axes.set_ylabel(ylabel, color=INK)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    return figure, axes


def draw_band(axes: "Axes", at: np.ndarray, found: Band, rank: int, label: str) -> None:
    """Draw values and, where there are two seeds or more, the band around them.

    Args:
        axes: Where.
        at: What stands along the axis, (K,).
        found: Values and ends, (K,).
        rank: Which method it is; it sets colour and dashes.
        label: For the legend.
    """
    shade, marker = colour(rank), "o" if len(at) <= _FEW else ""
    axes.plot(at, found.value, dashes(rank), marker=marker, markersize=4, color=shade,
              linewidth=2, label=label)  # fmt: skip
    if found.seeds > 1:
        axes.fill_between(at, found.low, found.high, color=shade, alpha=0.18, linewidth=0)


def point(found: Band, index: int) -> Interval:
    """One point of a band."""
    return Interval(value=float(found.value[index]), low=float(found.low[index]),
                    high=float(found.high[index]), confidence=found.confidence,
                    seeds=found.seeds)  # fmt: skip


def foot(figure: "Figure", what: str, cost: Cost, seeds: Iterable[int]) -> None:
    """Write below the figure what its intervals are, and what it cost.

    Args:
        figure: The figure.
        what: What is drawn, with the kind of interval.
        cost: Steps and seconds of everything in it.
        seeds: Seeds of each method; a lone one is said to know nothing.
    """
    lines = [f"{what} {ONE_SEED}" if 1 in set(seeds) else what, f"Cost: {cost}."]
    told = "\n".join(textwrap.fill(line, _COLUMNS) for line in lines)
    figure.supxlabel(told, fontsize=8, color=INK, x=0.01, ha="left", linespacing=1.4)


def counted(count: int, one: str = "seed") -> str:
    """A number with its noun: "1 seed", "10 seeds"."""
    return f"{count} {one}" if count == 1 else f"{count} {one}s"


def number(value: float) -> str:
    """A number as it is read: whole from 1000 on, otherwise to three digits."""
    return f"{value:.0f}" if abs(value) >= 999.5 else f"{value:.3g}"


def percent(confidence: float) -> str:
    """A confidence as it is read: "95 %"."""
    return f"{100 * confidence:.3g} %"


def bootstrapped(confidence: float, over: str = "seeds") -> str:
    """What a bootstrap interval is over, in words."""
    return f"{percent(confidence)} bootstrap interval over {over}"


def told(found: Interval, of: str = "seed") -> str:
    """An interval in words, for alt text.

    Args:
        found: The interval.
        of: What was counted, a noun.

    Example:
        >>> told(Interval(value=5.0, low=4.0, high=6.5, confidence=0.95, seeds=8))
        '5 (95 % interval 4 to 6.5, 8 seeds)'
    """
    count = counted(found.seeds, of)
    if not found.known:
        return f"{number(found.value)} ({count}, no interval)"
    return (f"{number(found.value)} ({percent(found.confidence)} interval {number(found.low)} to "
            f"{number(found.high)}, {count})")  # fmt: skip
