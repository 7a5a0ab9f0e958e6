"""A run in one figure: where its learners are on their paths, and what their policies return."""

import dataclasses
import textwrap
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from revolver_lab.lab import plot_parts as parts
from revolver_lab.lab.trees import Drawing
from revolver_lab.runs import LearnerStatus, Status
from revolver_lab.runs.so_far import Curves
from revolver_lab.stats import Band, Cost, band

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONFIDENCE = 0.95
_RESAMPLES = 2000  # a live figure is drawn often
_FOOT = ("Dots: learners; hollow while they learn, a cross where one failed. Line: mean. Band: "
         f"{parts.bootstrapped(CONFIDENCE)}, at each point. Thin: one learner, as it trains, on "
         "the robots E(beta).")  # fmt: skip


class History:
    """Training returns of a run's learners against their steps, kept while one looks at it."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, int], dict[int, float]] = {}

    def see(self, status: Status) -> None:
        """Remembers the latest training return of each learner.

        Args:
            status: How the run is doing.
        """
        for one in status.learners:
            if one.episode_return is not None and np.isfinite(one.episode_return):
                self._seen.setdefault((one.method, one.seed), {})[one.steps] = one.episode_return

    def read(self, curves: Iterable[Curves]) -> None:
        """Takes the returns of the phases that are over, in place of what was seen.

        Args:
            curves: What `so_far` read from the run's folder.
        """
        for one in curves:
            self._seen[one.method, one.seed] = {
                int(phase["steps"]): phase["episode_return"] for phase in one.phases
                if np.isfinite(phase["episode_return"])
            }  # fmt: skip

    def of(self, method: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Returns steps and training returns of a learner, (K,) each."""
        seen = sorted(self._seen.get((method, seed), {}).items())
        return np.array([at for at, _ in seen]), np.array([value for _, value in seen])


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Evaluated:
    """Returns of one method on the target, as far as all of its seeds have come.

    Attributes:
        steps: When, (K,) [steps].
        found: Mean over seeds, with intervals, (K,).
        left_out: Learners that failed, and are in none of these numbers.
    """

    steps: np.ndarray
    found: Band
    left_out: int


def evaluated(learners: Sequence[LearnerStatus]) -> Evaluated | None:
    """Returns what a method's policies return on the target.

    Args:
        learners: Those of one method.

    Returns:
        None until every seed that has not failed has been evaluated once.
    """
    sound = [one for one in learners if not one.failure]
    count = min((len(one.evaluations) for one in sound), default=0)
    if count == 0:
        return None
    table = np.array([one.evaluations[:count] for one in sound], dtype=float)  # (S, K, 2)
    found = band(table[:, :, 1], confidence=CONFIDENCE, resamples=_RESAMPLES)
    return Evaluated(steps=table[:, :, 0].mean(axis=0), found=found,
                     left_out=len(learners) - len(sound))  # fmt: skip


def draw(status: Status, history: History, cost: Cost, title: str) -> Drawing:
    """Draws a run as it is now.

    Args:
        status: How it is doing.
        history: Training returns so far.
        cost: What it cost so far.
        title: Its robot and state, in words.
    """
    from matplotlib.figure import Figure

    groups = by_method(status.learners)
    tall = 0.5 + 0.34 * max(len(groups), 1)
    figure = Figure(figsize=(parts.WIDTH, tall + 3.6), layout="constrained")
    paths, below = np.ravel(np.asarray(figure.subfigures(2, 1, height_ratios=(tall, 3.1))))
    _draw_paths(paths.subplots(), groups)
    target, training = below.subplots(1, 2)
    found = {name: evaluated(some) for name, some in groups.items()}
    _draw_target(target, found)
    _draw_training(training, groups, history)
    figure.suptitle(textwrap.fill(title, 90), x=0.01, ha="left", fontsize=12, color=parts.INK)
    seeds = [each.found.seeds for each in found.values() if each]
    parts.foot(figure, _FOOT, cost, seeds)
    told = " ".join(_told(name, some, found[name]) for name, some in groups.items())
    return Drawing(figure=figure, alt=f"{title}. {told} Cost: {cost}.")


def by_method(learners: Sequence[LearnerStatus]) -> dict[str, list[LearnerStatus]]:
    """Returns the learners of each method, in the order they come."""
    groups: dict[str, list[LearnerStatus]] = {}
    for one in learners:
        groups.setdefault(one.method, []).append(one)
    return groups


def _draw_paths(axes: "Axes", groups: dict[str, list[LearnerStatus]]) -> None:
    """One row a method, one dot a learner."""
    _dress(axes, "alpha: 0 is the source, 1 the target", "")
    for rank, some in enumerate(groups.values()):
        shade = parts.colour(rank)
        places = rank + _spread(len(some))
        for one, place in zip(some, places, strict=True):
            full = one.over and not one.failure
            axes.plot(one.alpha, place, "x" if one.failure else "o", color=shade, markersize=6,
                      markerfacecolor=shade if full else "white", clip_on=False)  # fmt: skip
    axes.set_yticks(range(len(groups)), [f"{name} ({len(some)})" for name, some in groups.items()])
    for rank, label in enumerate(axes.get_yticklabels()):
        label.set_color(parts.colour(rank))
    axes.set_ylim(max(len(groups), 1) - 0.5, -0.5)
    axes.set_xlim(-0.02, 1.02)


def _draw_target(axes: "Axes", found: dict[str, Evaluated | None]) -> None:
    """Mean and band of each method's returns on the target."""
    _dress(axes, "environment steps", "return on the target, unshaped")
    for rank, (name, each) in enumerate(found.items()):
        if each is not None:
            parts.draw_band(axes, each.steps, each.found, rank, name)
    if not any(found.values()):
        axes.text(0.5, 0.5, "no evaluation yet", transform=axes.transAxes, ha="center",
                  color=parts.INK)  # fmt: skip


def _draw_training(axes: "Axes", groups: dict[str, list[LearnerStatus]], history: History) -> None:
    """Every learner's return as it trains."""
    _dress(axes, "environment steps", "return in training, unshaped")
    for rank, some in enumerate(groups.values()):
        for one in some:
            at, values = history.of(one.method, one.seed)
            axes.plot(at, values, parts.dashes(rank), color=parts.colour(rank), linewidth=1,
                      alpha=0.7, marker="." if len(at) == 1 else "")  # fmt: skip


def _dress(axes: "Axes", xlabel: str, ylabel: str) -> None:
    """Gives axes the look of the other figures of results."""
    axes.set_xlabel(xlabel, color=parts.INK, fontsize=9)
    axes.set_ylabel(ylabel, color=parts.INK, fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
    axes.grid(color=parts.GRID, linewidth=0.8)
    axes.set_axisbelow(True)


def _spread(count: int) -> np.ndarray:
    """Offsets across a row, so that learners at one alpha stay apart."""
    return np.linspace(-0.28, 0.28, count) if count > 1 else np.zeros(count)


def _told(name: str, some: Sequence[LearnerStatus], each: Evaluated | None) -> str:
    """What the figure shows of one method, in words."""
    alphas = [one.alpha for one in some]
    where = f"at alpha {min(alphas):.2f}"
    if max(alphas) > min(alphas):
        where += f" to {max(alphas):.2f}"
    words = f"{name}: {parts.counted(len(some), 'learner')} {where}"
    failed = sum(bool(one.failure) for one in some)
    if failed:
        words += f", {failed} failed and not in the mean"
    if each is None:
        return f"{words}, not evaluated yet."
    last = parts.told(parts.point(each.found, -1))
    return f"{words}, return on the target {last} after {each.steps[-1]:.0f} steps."
