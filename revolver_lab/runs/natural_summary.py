"""Results of natural methods as a small table: success on the target, and how long it took."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from revolver_lab import stats
from revolver_lab.runs.results import LearnerResult, Results

GOOD = 0.9
"""A learner got there with this success on the target, over fresh episodes: the paper's number."""


def is_natural(results: Results) -> bool:
    """Whether all learners say which episodes succeeded."""
    return all(one.successes is not None for one in results.learners)


def natural_rows(results: Results) -> list[dict[str, Any]]:
    """Returns one row a method.

    A learner's time is the iteration after which its gate was content, at success on the target
    in fresh episodes; one that never was is censored where its budget ended, and one that was
    stopped by its numbers where the last of its method was.

    Args:
        results: Of natural methods.

    Returns:
        Robot, method, seeds; mean success on the target at the end with a 95 % interval over
        seeds; the fraction of learners with a success of `GOOD` or more, with its interval; the
        median iteration at which the gate was content (infinite where fewer than half got there)
        and the iterations of the censored; environment steps.
    """
    return [_row(results, method) for method in results.methods]


def _row(results: Results, method: str) -> dict[str, Any]:
    """Returns the row of one method."""
    some = results.of(method)
    scores = np.array([success_of(one) for one in some])
    mean, good = stats.interval(scores, "mean"), stats.success(scores >= GOOD)
    content = np.array([bool(one.finished) for one in some])
    made = _watched(some, content)
    curve = stats.kaplan_meier(made, content)
    return {
        "robot": results.robot, "method": method, "seeds": len(some), "success": mean.value,
        "success_low": mean.low, "success_high": mean.high, "least": float(scores.min()),
        "good": int((scores >= GOOD).sum()), "good_low": good.low, "good_high": good.high,
        "finished": int(content.sum()), "median_iterations": curve.median,
        "censored_at": int(made[~content].max()) if (~content).any() else None,
        "farthest": float(np.mean([farthest(one) for one in some])),
        "steps": sum(one.cost.steps for one in some),
        "evaluation_steps": sum(one.cost.evaluation_steps for one in some),
        "minutes": float(np.median([one.cost.seconds for one in some])) / 60,
        "failures": sum(bool(one.failure) for one in some),
    }  # fmt: skip


def _watched(some: Sequence[LearnerResult], content: np.ndarray) -> np.ndarray:
    """Returns the iterations after which learners were content, or up to which they were watched.

    Who broke down will never get there: to count it as one whose budget ended then would have a
    method that breaks down early look quick. It counts as watched as long as anybody.

    Args:
        some: Learners of one method.
        content: Whether the gate of each was, (S,).
    """
    made = np.array([iterations_of(one) for one in some])
    broken = np.array([bool(one.failure) for one in some])
    return np.where(broken & ~content, made.max(), made)


def when_content(row: dict[str, Any]) -> str:
    """Returns after how many iterations the gate was content, and how many learners' was not.

    Args:
        row: One of `natural_rows`.

    Example:
        >>> when_content({"median_iterations": 99.0, "finished": 3, "seeds": 5, "censored_at": 200})
        '99; 2 not in 200'
    """
    if not np.isfinite(row["median_iterations"]):
        return f"not in {row['censored_at']}"
    missing = row["seeds"] - row["finished"]
    others = f"; {missing} not in {row['censored_at']}" if missing else ""
    return f"{row['median_iterations']:.0f}{others}"


def over_iterations(
    results: Results, key: str, methods: Sequence[str] | None = None
) -> dict[str, np.ndarray]:
    """Returns a number of every iteration, (seeds, iterations) a method.

    A learner that ended before others goes on with its last value, so that all are as long; where
    a table was thinned, the value before stands in.

    Args:
        results: Of natural methods.
        key: A field of `revolver_lab.natural_log.Iteration`, such as "alpha" or "success".
        methods: Which methods; None takes all.
    """
    chosen = methods or results.methods
    longest = max(iterations_of(one) for name in chosen for one in results.of(name))
    return {name: np.stack([_filled(one, key, longest) for one in results.of(name)])
            for name in chosen}  # fmt: skip


def _filled(one: LearnerResult, key: str, longest: int) -> np.ndarray:
    """Returns a number of every iteration, (longest,)."""
    at = np.array([made["iteration"] for made in one.iterations])
    known = np.array([made[key] for made in one.iterations])
    return known[np.maximum(np.searchsorted(at, np.arange(longest), side="right") - 1, 0)]


def iterations_of(one: LearnerResult) -> int:
    """Returns how many iterations a learner made."""
    return int(one.iterations[-1]["iteration"]) + 1 if one.iterations else 0


def success_of(one: LearnerResult) -> float:
    """Returns the success of a learner on the target in its last evaluation, nan without one."""
    return float("nan") if one.successes is None else float(one.successes.mean())


def farthest(one: LearnerResult) -> float:
    """Returns the alpha that a learner was at in its last iteration."""
    return float(one.iterations[-1]["alpha"]) if one.iterations else float("nan")


def describe_natural(results: Results) -> str:
    """Returns the table as text, with what it cost and how to train it again.

    Args:
        results: Of natural methods.
    """
    table = natural_rows(results)
    width = max(6, *(len(row["method"]) for row in table))
    lines = [f"{'method':<{width}}  seeds  success  95 % interval  >= {GOOD:.0%}    alpha  "
             "iterations (median)"]  # fmt: skip
    lines += [f"{row['method']:<{width}}  {_text(row)}" for row in table]
    lines += [f"{one.method}-{one.seed} was stopped: {one.failure}"
              for one in results.learners if one.failure]  # fmt: skip
    lines.append("success: of fresh episodes on the target, by mean actions; alpha: where the last "
                 "iteration was, on average")  # fmt: skip
    return "\n".join([*lines, f"cost: {results.cost}", *results.commands])


def _text(row: dict[str, Any]) -> str:
    """Returns the numbers of a row."""
    ends = f"{row['success_low']:.2f} to {row['success_high']:.2f}" if row["seeds"] > 1 else "one"
    of = f"{row['good']} of {row['seeds']}"
    return (f"{row['seeds']:>5}  {row['success']:>7.2f}  {ends:<13}  {of:<9}  "
            f"{row['farthest']:>5.2f}  {when_content(row)}")  # fmt: skip
