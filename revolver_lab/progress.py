"""One line that tells how several transfers are doing: phase, alpha, return and time left."""

import shutil
import sys
import time
from collections.abc import Mapping, Sequence
from typing import TextIO

from revolver_lab.natural_log import Iteration
from revolver_lab.recorder import Progress

_WIDTH = 16  # of the bar [characters]


def describe(name: str, progress: Progress) -> str:
    """Returns one transfer's progress as text.

    Example:
        >>> describe("revolver", Progress(phase=12, phases=26, alpha=0.48, steps=20000,
        ...     episode_return=143.2, seconds=60.0, seconds_left=125.0))
        'revolver [#####...........] phase 13/26  alpha 0.48  return 143.2  2:05 left'
    """
    total = progress.seconds + progress.seconds_left
    filled = int(_WIDTH * progress.seconds / total) if total else 0
    bar = "#" * filled + "." * (_WIDTH - filled)
    known = progress.episode_return == progress.episode_return
    score = f"{progress.episode_return:.1f}" if known else "-"
    return (
        f"{name} [{bar}] phase {progress.phase + 1}/{progress.phases}  alpha {progress.alpha:.2f}"
        f"  return {score}{_left(progress.seconds_left)}"
    )


def describe_iteration(name: str, made: Iteration, seconds_left: float | None = None) -> str:
    """Returns how a learner by natural policy gradient is doing, as text.

    Args:
        name: Of the learner.
        made: Its latest iteration.
        seconds_left: Expected time to the end [s], where it can be told.

    Example:
        >>> describe_iteration("revolver", Iteration(iteration=56, alpha=0.43, success=0.72,
        ...     average=0.7, episode_return=40.0, mean_beta=0.46, kl=0.02, log_std=-1.0,
        ...     explained=0.8, steps=241_920, wall_time=95.0))
        'revolver [#######.........] iteration 57  alpha 0.43  success 0.72  241,920 steps'
    """
    return describe_batches(name, made.iteration + 1, made.alpha, made.success, made.steps,
                            seconds_left)  # fmt: skip


def describe_batches(
    name: str, batches: int, alpha: float, success: float, steps: int,
    seconds_left: float | None = None,
) -> str:  # fmt: skip
    """Returns how one or several learners by natural policy gradient are doing, as text.

    Args:
        name: Of the learner, or of the method.
        batches: Iterations made, of several on average.
        alpha: Where they are.
        success: Fraction of the latest trajectories that succeeded.
        steps: Environment steps in all [steps].
        seconds_left: Expected time to the end [s], where it can be told.

    Example:
        >>> describe_batches("revolver", 30, 0.25, 0.5, 128_000)
        'revolver [####............] iteration 30  alpha 0.25  success 0.50  128,000 steps'
    """
    filled = round(_WIDTH * alpha)
    bar = "#" * filled + "." * (_WIDTH - filled)
    return (f"{name:<8} [{bar}] iteration {batches}  alpha {alpha:.2f}  success {success:.2f}"
            f"{_left(seconds_left)}  {steps:,} steps")  # fmt: skip


def _left(seconds: float | None) -> str:
    """Returns the time left as text; nothing where it is not known."""
    if seconds is None:
        return ""
    return f"  {round(seconds) // 60}:{round(seconds) % 60:02d} left"


class ProgressLines:
    """Rewrites its lines in place on a terminal; elsewhere prints them now and then.

    Args:
        stream: Where to write; None is standard output.
        every: Seconds between printings where lines cannot be rewritten [s].
    """

    def __init__(self, stream: TextIO | None = None, every: float = 20.0):
        self._stream = stream or sys.stdout
        self._every, self._last, self._drawn = every, 0.0, 0
        self._terminal = self._stream.isatty()

    def show(self, latest: Mapping[str, Progress]) -> None:
        """Draws the latest progress of each transfer.

        Args:
            latest: Progress by the transfer's name.
        """
        self.write([describe(name, progress) for name, progress in sorted(latest.items())])

    def write(self, lines: Sequence[str]) -> None:
        """Draws lines, unless the last drawing was just now.

        Args:
            lines: What to say.
        """
        now = time.monotonic()
        if now - self._last < (0.2 if self._terminal else self._every):
            return
        self._last = now
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            up = f"\x1b[{self._drawn}F" if self._drawn else ""
            self._stream.write(up + "".join(f"\x1b[K{line[:width]}\n" for line in lines))
            self._drawn = len(lines)
        else:
            self._stream.write("\n".join(lines) + "\n")
        self._stream.flush()
