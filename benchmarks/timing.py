"""Two pieces of work timed in turn, so that a drifting machine slows both."""

import statistics
import time
from collections.abc import Callable


def seconds(work: Callable[[], object]) -> float:
    """Wall time of one call."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def paired(ours: Callable[[], object], peer: Callable[[], object], runs: int) -> dict[str, float]:
    """Medians of both, and the median of the ratios ours/peer of neighbouring runs.

    Args:
        ours: The work measured.
        peer: What it is measured against.
        runs: How often each is run, in turn, after one warm-up.
    """
    ours(), peer()
    pairs = [(seconds(ours), seconds(peer)) for _ in range(runs)]
    return {
        "ours_s": statistics.median(a for a, _ in pairs),
        "peer_s": statistics.median(b for _, b in pairs),
        "ratio": statistics.median(a / b for a, b in pairs),
    }


def row(work: str, against: str, aim: str, ratio: float, detail: str) -> dict[str, object]:
    """One line of the report."""
    return {
        "work": work,
        "against": against,
        "aim": aim,
        "ratio": round(ratio, 3),
        "detail": detail,
    }
