"""Figures of fractions of seeds: who got there by when, and who scores more than what."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError
from revolver_lab.lab import plot_parts as parts
from revolver_lab.lab.trees import Drawing
from revolver_lab.stats import Cost, Survival, kaplan_meier, performance_profile

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def survival(
    by_method: Mapping[str, tuple[ArrayLike, ArrayLike]],
    *,
    cost: Cost,
    xlabel: str = "environment steps",
    title: str = "",
    confidence: float = 0.95,
) -> Drawing:
    """Fraction of seeds that have reached a threshold, against time: 1 - Kaplan-Meier.

    Runs that never got there are marked where they were last watched.

    Args:
        by_method: Name -> (times, observed), as `rvl.stats.time_to_threshold` gives them.
        cost: Of everything drawn.
        xlabel: What time is.
        title: Above the figure.
        confidence: In (0, 1).

    Raises:
        SettingsError: If there is nothing to draw, or the shapes do not match.
    """
    found = {name: kaplan_meier(*_pair(name, each), confidence)
             for name, each in parts.checked(by_method, cost).items()}  # fmt: skip
    figure, axes = parts.figure_and_axes(4.2, title, xlabel, "fraction of seeds that got there")
    end = max(curve.longest for curve in found.values())
    for rank, (name, curve) in enumerate(found.items()):
        _draw_survival(axes, curve, rank, name, end)
    axes.set_ylim(-0.03, 1.03)
    axes.set_xlim(left=0)
    figure.legend(loc="outside right upper", frameon=False, fontsize=9)
    what = (f"Line: Kaplan-Meier. Band: {parts.percent(confidence)} interval over seeds (Greenwood,"
            " log-log). |: a seed that had not got there when last watched.")  # fmt: skip
    parts.foot(figure, what, cost, [curve.seeds for curve in found.values()])
    told = "; ".join(_reached(name, curve) for name, curve in found.items())
    alt = f"{title or 'Fraction of seeds that got there'} against {xlabel}. {told}. Cost: {cost}."
    return Drawing(figure=figure, alt=alt)


def profile(
    by_method: Mapping[str, ArrayLike],
    thresholds: ArrayLike,
    *,
    cost: Cost,
    xlabel: str = "score",
    title: str = "",
    confidence: float = 0.95,
) -> Drawing:
    """Performance profiles: the fraction of runs that score more than each threshold.

    Args:
        by_method: Name -> scores, (runs, tasks), or (runs,) for one task.
        thresholds: (K,), increasing.
        cost: Of everything drawn.
        xlabel: What the scores are.
        title: Above the figure.
        confidence: In (0, 1).

    Raises:
        SettingsError: If there is nothing to draw, or scores are no finite numbers.
    """
    at = parts.axis(thresholds, "thresholds")
    found = {name: performance_profile(scores, at, confidence)
             for name, scores in parts.checked(by_method, cost).items()}  # fmt: skip
    figure, axes = parts.figure_and_axes(4.2, title, xlabel, "fraction of runs that score more")
    for rank, (name, each) in enumerate(found.items()):
        parts.draw_band(axes, at, each, rank, f"{name} ({parts.counted(each.seeds)})")
    axes.set_ylim(-0.03, 1.03)
    figure.legend(loc="outside right upper", frameon=False, fontsize=9)
    what = (f"Line: fraction of runs. Band: {parts.bootstrapped(confidence)}, "
            "at each score.")  # fmt: skip
    parts.foot(figure, what, cost, [each.seeds for each in found.values()])
    middle = len(at) // 2
    told = "; ".join(
        f"{name} {parts.told(parts.point(each, middle))}" for name, each in found.items()
    )
    alt = f"{title or 'Fraction of runs that score more'} against {xlabel}."
    alt += f" Above {parts.number(at[middle])}: {told}. Cost: {cost}."
    return Drawing(figure=figure, alt=alt)


def _pair(name: str, given: tuple[ArrayLike, ArrayLike]) -> tuple[ArrayLike, ArrayLike]:
    """Times and whether each was observed."""
    if not isinstance(given, tuple) or len(given) != 2:
        raise SettingsError(f"a {type(given).__name__} for {name!r}", "(times, observed)",
                            "Pass what rvl.stats.time_to_threshold returns.")  # fmt: skip
    return given


def _draw_survival(axes: "Axes", curve: Survival, rank: int, name: str, end: float) -> None:
    """Draw 1 - S as steps, its band from the first step on, and a mark for each censored run."""
    end = curve.longest if curve.left else end  # once all are there, they stay there
    shade, style = parts.colour(rank), parts.dashes(rank)
    label = f"{name}\n({int(curve.events.sum())} of {parts.counted(curve.seeds)})"
    times = np.concatenate([[0.0], curve.times, [end]])
    there = 1 - np.concatenate([[1.0], curve.survival, [curve.left]])
    axes.step(times, there, style, where="post", color=shade, linewidth=2, label=label)
    if curve.seeds > 1 and curve.times.size:
        low, high = (1 - np.append(side, side[-1]) for side in (curve.high, curve.low))
        axes.fill_between(times[1:], low, high, step="post", color=shade, alpha=0.15, linewidth=0)
    if curve.censored.size:
        axes.plot(curve.censored, 1 - curve.at(curve.censored), "|", color=shade, markersize=11,
                  markeredgewidth=1.6)  # fmt: skip


def _reached(name: str, curve: Survival) -> str:
    """How many seeds got there, and by when half of them, in words."""
    count = f"{name}: {int(curve.events.sum())} of {parts.counted(curve.seeds)} got there"
    half = curve.median
    if not np.isfinite(half):
        return f"{count}, fewer than half by {parts.number(curve.longest)}"
    if curve.seeds == 1:
        return f"{count}, at {parts.number(half)} (no interval)"
    index = int(np.searchsorted(curve.times, half))
    low, high = parts.number(1 - curve.high[index]), parts.number(1 - curve.low[index])
    return (f"{count}, half of them by {parts.number(half)} "
            f"({parts.percent(curve.confidence)} interval there {low} to {high})")  # fmt: skip
