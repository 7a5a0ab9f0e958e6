"""Tables of results as Markdown, for pages that a test holds to the recorded runs."""

import math

from revolver_lab import stats
from revolver_lab.runs.natural_summary import GOOD, is_natural, natural_rows, when_content
from revolver_lab.runs.results import Results
from revolver_lab.runs.summary import success_from

_RETURNS = "| method | return on E(1), mean over seeds (95 % interval) | {} or more |"
_SUCCESSES = (
    f"| method | success on E(1), mean over seeds (95 % interval) | lowest | at least {GOOD:.0%} "
    "| iterations until the gate was content, median | alpha at the end |"
)


def markdown(results: Results, threshold: float | None = None) -> str:
    """Returns one row a method, and below the table what it cost.

    Args:
        results: Of one robot and task; of natural methods successes are told, else returns.
        threshold: As in `revolver_lab.runs.summary.rows`; None is half of home.

    Raises:
        SettingsError: If the threshold is no finite number.
    """
    least = success_from(results, threshold)
    named = "half of home" if threshold is None else f"{least:.4g}"
    lines = _successes(results) if is_natural(results) else _returns(results, least, named)
    commands = [f"    {command}" for command in dict.fromkeys(results.commands)]
    return "\n".join([*lines, "", f"Cost: {results.cost}.", "", *commands])


def _successes(results: Results) -> list[str]:
    """Returns the table of natural methods."""
    lines = [_SUCCESSES, "|---|---|---|---|---|---|"]
    for row in natural_rows(results):
        spread = f"{row['success']:.3f} ({_ends(row['success_low'], row['success_high'], 3)})"
        lines.append(f"| {row['method']} | {spread} | {row['least']:.2f} | {row['good']} of "
                     f"{row['seeds']} | {when_content(row)} | {row['farthest']:.2f} |")  # fmt: skip
    return lines


def _returns(results: Results, least: float | None, named: str) -> list[str]:
    """Returns the table of the other methods."""
    lines = [_RETURNS.format(named), "|---|---|---|"]
    for method, scores in results.scores().items():
        found = stats.interval(scores, "mean")
        won = "-" if least is None else f"{int((scores >= least).sum())} of {len(scores)}"
        lines.append(f"| {method} | {found.value:.1f} ({_ends(found.low, found.high, 1)}) | "
                     f"{won} |")  # fmt: skip
    return lines


def _ends(low: float, high: float, digits: int) -> str:
    """Returns an interval in words; a single seed has none."""
    known = math.isfinite(low) and math.isfinite(high)
    return f"{low:.{digits}f} to {high:.{digits}f}" if known else "one seed, no interval"
