"""Results as a small table: one row a method, with its interval, seeds, successes and cost."""

from typing import Any

from revolver_lab import stats
from revolver_lab.errors import SettingsError
from revolver_lab.given import is_number
from revolver_lab.robots import registry
from revolver_lab.runs.natural_summary import describe_natural, is_natural, natural_rows
from revolver_lab.runs.results import Results
from revolver_lab.trajectories import half_of_home


def success_return(results: Results) -> float | None:
    """Returns from which mean return on the target on a learner succeeds: half of home.

    Args:
        results: Of a run, or of several put together.

    Returns:
        See `half_of_home`; None where it is not known what the expert returns at home, as it is of
        the robot's usual reward only, or where that is no more than a robot returns that does
        nothing.
    """
    idle = 0.0
    if results.robot in registry.names():
        robot = registry.get(results.robot)
        if results.task not in (None, robot.usual_task):
            return None
        idle = robot.make_task().idle_return
    home = results.expert_return
    return None if home is None or home <= idle else half_of_home(home, idle)


def success_from(results: Results, threshold: float | None = None) -> float | None:
    """Returns from which mean return on, it included, a learner succeeds.

    Args:
        results: Of a run, or of several put together.
        threshold: What somebody asks for; None is that of `success_return`.

    Raises:
        SettingsError: If it is no finite number.
    """
    if threshold is None:
        return success_return(results)
    if not is_number(threshold):
        raise SettingsError(f"threshold = {threshold!r}", "a finite number",
                            "Leave it out for half of what the expert gains at home.")  # fmt: skip
    return float(threshold)


def rows(results: Results, threshold: float | None = None) -> list[dict[str, Any]]:
    """Returns one row a method; natural methods have rows of their own, see `natural_rows`.

    Args:
        results: Of a run, or of several put together.
        threshold: Mean unshaped return on the target from which on, it included, a learner
            succeeds; None is that of `success_return`. Natural methods tell success themselves.

    Returns:
        Robot, method, seeds, mean and IQM of the learners' returns with 95 % intervals, the
        fraction that succeeded with its own, and environment steps.

    Raises:
        SettingsError: If the threshold is no finite number.
    """
    threshold = success_from(results, threshold)
    if is_natural(results):
        return natural_rows(results)
    return [_row(results, method, threshold) for method in results.methods]


def _row(results: Results, method: str, threshold: float | None) -> dict[str, Any]:
    """Returns the row of one method."""
    scores = results.scores([method])[method]
    row: dict[str, Any] = {"robot": results.robot, "method": method, "seeds": len(scores)}
    for statistic in ("mean", "iqm"):
        found = stats.interval(scores, statistic)
        row |= {statistic: found.value, f"{statistic}_low": found.low,
                f"{statistic}_high": found.high}  # fmt: skip
    names = ("success", "success_low", "success_high", "threshold")
    row |= dict.fromkeys(names)
    if threshold is not None:
        won = stats.success(scores >= threshold)
        row |= dict(zip(names, (won.value, won.low, won.high, threshold)))
    return row | {
        "steps": sum(one.cost.steps for one in results.of(method)),
        "evaluation_steps": sum(one.cost.evaluation_steps for one in results.of(method)),
        "failures": sum(bool(one.failure) for one in results.of(method)),
    }


def describe(results: Results, threshold: float | None = None) -> str:
    """Returns the table as text, with what it cost and how to train it again.

    Args:
        results: Of a run, or of several put together.
        threshold: As in `rows`.
    """
    table = rows(results, threshold)
    if is_natural(results):
        return describe_natural(results)
    width = max(6, *(len(row["method"]) for row in table))
    lines = [f"{'method':<{width}}  seeds    mean  95 % interval    success  95 % interval"]
    lines += [f"{row['method']:<{width}}  {_text(row)}" for row in table]
    lines += [f"{one.method}-{one.seed} was stopped: {one.failure}"
              for one in results.learners if one.failure]  # fmt: skip
    if table[0]["threshold"] is not None:
        lines.append(f"success: a mean return of {table[0]['threshold']:.4g} or more on the target")
    return "\n".join([*lines, f"cost: {results.cost}", *results.commands])


def _text(row: dict[str, Any]) -> str:
    """Returns the numbers of a row; one seed has no interval."""

    def ends(name: str) -> str:
        known = row["seeds"] > 1 or name == "success"
        return f"{row[f'{name}_low']:.4g} to {row[f'{name}_high']:.4g}" if known else "one seed"

    shown = f"{row['seeds']:>5}  {row['mean']:>6.4g}  {ends('mean'):<15}"
    if row["success"] is None:
        return f"{shown}  {'-':>7}"
    return f"{shown}  {row['success']:>7.0%}  {row['success_low']:.0%} to {row['success_high']:.0%}"
