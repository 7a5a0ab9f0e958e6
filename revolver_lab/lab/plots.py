"""Figures of results: each shows its interval, its number of seeds and what it cost in all."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from revolver_lab.errors import SettingsError
from revolver_lab.lab import plot_parts as parts
from revolver_lab.lab.plot_fractions import profile, survival
from revolver_lab.lab.trees import Drawing
from revolver_lab.stats import Band, Cost, band, interval
from revolver_lab.stats.checks import as_scores, numbers

__all__ = ["along_alpha", "curves", "profile", "rows", "survival"]


def curves(
    by_method: Mapping[str, ArrayLike],
    steps: ArrayLike,
    *,
    cost: Cost,
    ylabel: str = "return, unshaped",
    title: str = "",
    xlabel: str = "environment steps",
    confidence: float = 0.95,
) -> Drawing:
    """Mean over seeds against steps, with a band of pointwise intervals.

    Args:
        by_method: Name -> evaluation curves, (S, K); (K,) is one seed, drawn without a band.
        steps: When the evaluations were, (K,).
        cost: Of everything drawn.
        ylabel: What was measured.
        title: Above the figure.
        xlabel: What the steps are.
        confidence: In (0, 1).

    Raises:
        SettingsError: If there is nothing to draw, or the shapes do not match.
    """
    at = parts.axis(steps, "steps")
    bands = {name: band(_rows(name, table, len(at)), confidence=confidence)
             for name, table in parts.checked(by_method, cost).items()}  # fmt: skip
    figure, axes = parts.figure_and_axes(4.2, title, xlabel, ylabel)
    for rank, (name, found) in enumerate(bands.items()):
        parts.draw_band(axes, at, found, rank, f"{name} ({parts.counted(found.seeds)})")
    if at[0] > 0.0:
        axes.set_xlim(left=0.0)  # a curve that is first measured late does not begin there
    figure.legend(loc="outside right upper", frameon=False, fontsize=9)
    what = f"Line: mean. Band: {parts.bootstrapped(confidence)}, at each point."
    parts.foot(figure, what, cost, [found.seeds for found in bands.values()])
    ends = [f"{name} ends at {parts.told(parts.point(found, -1))}" for name, found in bands.items()]
    alt = f"{title or ylabel} against {xlabel}, up to {parts.number(at[-1])}. {'; '.join(ends)}."
    return Drawing(figure=figure, alt=f"{alt} Cost: {cost}.")


def rows(
    by_method: Mapping[str, ArrayLike],
    *,
    cost: Cost,
    xlabel: str = "return on the target, unshaped",
    title: str = "",
    statistic: str = "mean",
    confidence: float = 0.95,
) -> Drawing:
    """One row for each method: a dot with its interval, and each seed as a faint dot.

    Args:
        by_method: Name -> scores of its seeds, (S,), or (S, episodes), which are averaged first:
            episodes of one policy are no independent seeds. The first is the top row.
        cost: Of everything drawn.
        xlabel: What was measured.
        title: Above the figure.
        statistic: A name in `rvl.stats.STATISTICS`.
        confidence: In (0, 1).

    Raises:
        SettingsError: If there is nothing to draw, or scores are no finite numbers.
    """
    scores = {name: as_scores(given, f"scores of {name!r}").mean(axis=1)
              for name, given in parts.checked(by_method, cost).items()}  # fmt: skip
    found = {name: interval(each, statistic, confidence) for name, each in scores.items()}
    figure, axes = parts.figure_and_axes(1.5 + 0.42 * len(found), title, xlabel, "")
    for rank, (name, each) in enumerate(found.items()):
        shade, seeds = parts.colour(rank), scores[name]
        axes.plot(seeds, _spread(len(seeds)) + rank, "o", color=shade, alpha=0.3, markersize=5,
                  markeredgewidth=0)  # fmt: skip
        if each.known:
            axes.plot([each.low, each.high], [rank, rank], color=shade, linewidth=2.5)
        axes.plot(each.value, rank, "o" if each.known else "D", color=shade, markersize=8,
                  markerfacecolor=shade if each.known else "white")  # fmt: skip
    labels = [f"{name}\n{parts.counted(each.seeds)}" for name, each in found.items()]
    axes.set_yticks(range(len(found)), labels)
    axes.set_ylim(len(found) - 0.5, -0.5)
    if min(each.min() for each in scores.values()) > 0:
        axes.set_xlim(left=0.0)  # or a tie would look like a spread
    what = f"Dot: {statistic}. Bar: {parts.bootstrapped(confidence)}. Faint: a seed."
    parts.foot(figure, what, cost, [each.seeds for each in found.values()])
    told = "; ".join(f"{name} {parts.told(each)}" for name, each in found.items())
    alt = f"{title or xlabel}, {statistic} of each method. {told}. Cost: {cost}."
    return Drawing(figure=figure, alt=alt)


def along_alpha(
    by_name: Mapping[str, ArrayLike],
    alphas: ArrayLike,
    *,
    cost: Cost,
    ylabel: str = "return, unshaped",
    title: str = "",
    confidence: float = 0.95,
) -> Drawing:
    """Return of policies on every robot from source to target: the cliff, where there is one.

    Args:
        by_name: Name -> returns, (A, episodes), as `rvl.evaluate` gives them for one policy, with
            an interval over its episodes, which says nothing about other seeds; or
            (S, A, episodes), with an interval over seeds.
        alphas: The robots, (A,), each in [0, 1].
        cost: Of everything drawn.
        ylabel: What was measured.
        title: Above the figure.
        confidence: In (0, 1).

    Raises:
        SettingsError: If there is nothing to draw, or the shapes do not match.
    """
    at = parts.axis(alphas, "alphas")
    if at[0] < 0.0 or at[-1] > 1.0:
        raise SettingsError(f"alphas from {at[0]:g} to {at[-1]:g}", "[0, 1]",
                            "0 is the source, 1 the target.")  # fmt: skip
    found = {name: _on_robots(name, returns, len(at), confidence)
             for name, returns in parts.checked(by_name, cost).items()}  # fmt: skip
    figure, axes = parts.figure_and_axes(4.2, title, "alpha: 0 is the source, 1 the target", ylabel)
    for rank, (name, (each, of)) in enumerate(found.items()):
        label = f"{name} ({parts.counted(each.seeds, of)}{', 1 seed' * (of == 'episode')})"
        parts.draw_band(axes, at, each, rank, label)
    figure.legend(loc="outside right upper", frameon=False, fontsize=9)
    kinds = sorted({f"{of}s" for _, of in found.values()}, reverse=True)
    one = " An interval over episodes is of one policy, not of other seeds." * ("episodes" in kinds)
    what = f"Line: mean. Band: {parts.bootstrapped(confidence, ' or '.join(kinds))}.{one}"
    parts.foot(figure, what, cost, [each.seeds for each, of in found.values() if of == "seed"])
    told = [_along(name, at, each, of) for name, (each, of) in found.items()]
    alt = f"{title or ylabel} against alpha. {' '.join(told)} Cost: {cost}."
    return Drawing(figure=figure, alt=alt)


def _rows(name: str, given: ArrayLike, points: int) -> np.ndarray:
    """Curves of one method, (S, points)."""
    table = np.atleast_2d(numbers(given, f"curves of {name!r}"))
    if table.shape != (len(table), points):
        raise SettingsError(f"curves of {name!r} of shape {table.shape}", f"(S, {points})",
                            "Give a row for each seed, as long as steps.")  # fmt: skip
    return table


def _on_robots(name: str, given: ArrayLike, robots: int, confidence: float) -> tuple[Band, str]:
    """Mean on each robot, and what its intervals are over: "seed" or "episode"."""
    table = numbers(given, f"returns of {name!r}")
    if table.ndim not in (2, 3) or table.shape[-2] != robots:
        raise SettingsError(f"returns of {name!r} of shape {table.shape}",
                            f"({robots}, episodes) or (S, {robots}, episodes)",
                            "Pass what rvl.evaluate returns on these alphas.")  # fmt: skip
    if table.ndim == 2:
        return band(table.T, confidence=confidence), "episode"
    return band(table.mean(axis=2), confidence=confidence), "seed"


def _along(name: str, alphas: np.ndarray, found: Band, of: str) -> str:
    """Both ends of a curve over alpha, and its lowest point, in words."""
    lowest = int(np.argmin(found.value))
    first, last, low = (parts.told(parts.point(found, k), of) for k in (0, -1, lowest))
    return (f"{name}: {first} at alpha {alphas[0]:.3g}, {last} at alpha {alphas[-1]:.3g}, lowest "
            f"at alpha {alphas[lowest]:.3g} with {low}.")  # fmt: skip


def _spread(count: int) -> np.ndarray:
    """Offsets across a row, so that equal seeds stay apart."""
    return 0.22 * (np.arange(count) % 5 - (min(count, 5) - 1) / 2) / 2
