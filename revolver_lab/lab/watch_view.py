"""What is seen of a run, without any widget: its state in words, and its figure."""

import dataclasses

from revolver_lab.errors import PolicyFileError, RevolverError
from revolver_lab.lab.trees import Drawing
from revolver_lab.lab.watch_figure import History, draw
from revolver_lab.policies import Policy
from revolver_lab.robots import registry
from revolver_lab.runs import Run, Status, store
from revolver_lab.runs.so_far import so_far
from revolver_lab.stats import Cost

_WORDS = {
    "new": "not started",
    "running": "training",
    "stopping": "stopping: the workers write their checkpoints",
    "stopped": "stopped",
    "finished": "finished",
    "failed": "failed",
    "gone": "its folder is gone",
}
_HINTS = {"stopped": "; Resume goes on from here", "gone": "; Resume begins anew"}


class View:
    """What is seen of one run.

    Args:
        run: The run.
    """

    def __init__(self, run: Run):
        self.run, self.history = run, History()
        self._seen = self._read = self._ended = False

    def look(self) -> Status:
        """Returns how the run is doing; its state may also be "stopping", or "gone".

        Raises:
            RevolverError: If its files are there and cannot be read.
        """
        try:
            status = self.run.status()
        except (RevolverError, OSError):  # somebody may be deleting it
            if not self._gone():
                raise
            status = Status(state="gone", learners=(), steps=0, steps_planned=1, seconds=0.0)
        if not self._read and status.learners:
            self._read = True
            self.history.read(so_far(self.run.folder))
        self.history.see(status)
        if status.state == "running" and (self.run.folder / store.STOP).exists():
            return dataclasses.replace(status, state="stopping")
        if status.state != "finished" and self._gone():
            # Its workers end by themselves once they see it.
            return dataclasses.replace(
                status, state="stopping" if status.state == "running" else "gone"
            )
        return status

    def _gone(self) -> bool:
        """Whether the folder was there and is not."""
        there = (self.run.folder / store.CONFIG).exists()
        self._seen |= there
        return self._seen and not there

    def headline(self, status: Status, *, resuming: bool = False, hint: bool = True) -> str:
        """Returns in words how the run is.

        Args:
            status: What `look` returned.
            resuming: Whether it will be resumed as soon as it has stopped.
            hint: Whether to say what its buttons do.
        """
        words = f"{self.run.plan.robot}: {_WORDS[status.state]}"
        words += _HINTS.get(status.state, "") if hint else ""
        if status.state == "stopping" and resuming:
            words += ", and then go on"
        if status.state == "running" and not status.learners:
            words += "; the workers are being started"
        failed = [f"{one.method}, seed {one.seed} ({one.failure})"
                  for one in status.learners
                  if one.failure and one.failure not in status.message]  # fmt: skip
        if failed:
            words += f". Learners stopped before their end: {'; '.join(failed)}"
        return f"{words}. {status.message}".strip().removesuffix(".") + "."

    def drawing(self, status: Status) -> Drawing:
        """Draws the run.

        Args:
            status: What `look` returned.
        """
        if status.state == "finished" and not self._ended:
            self.history.read(so_far(self.run.folder))
            self._ended = True
        title = self.headline(status, hint=False).removesuffix(".")
        if status.state not in ("finished", "gone", "new"):
            title += f", {status.fraction:.0%}"
        return draw(status, self.history, self.cost(status), title)

    def cost(self, status: Status) -> Cost:
        """Returns what the run has cost so far, its evaluations and its expert counted.

        Args:
            status: How it is doing.
        """
        plan = self.run.plan
        length = registry.get(plan.robot).make_task(plan.task).episode_steps
        evaluations = sum(len(one.evaluations) for one in status.learners)
        try:
            expert = Policy.load(self.run.folder / store.EXPERT).card.steps
        except PolicyFileError:  # no method began with one
            expert = 0
        return Cost(steps=sum(one.steps for one in status.learners), seconds=status.seconds,
                    evaluation_steps=evaluations * plan.evaluate_episodes * length,
                    expert_steps=expert)  # fmt: skip


def numbers(status: Status) -> str:
    """Returns how far a run is, and how long it still takes.

    Args:
        status: How it is doing.

    Example:
        >>> numbers(Status(state="running", learners=(), steps=500, steps_planned=2000,
        ...                seconds=20.0))
        '25 %, 500 of 2,000 steps, 0:20 so far, 1:00 left'
    """
    words = (f"{100 * status.fraction:.0f} %, {status.steps:,} of {status.steps_planned:,} steps, "
             f"{_clock(status.seconds)} so far")  # fmt: skip
    if status.state == "running" and status.steps:
        words += f", {_clock(status.seconds_left)} left"
    return words


def _clock(seconds: float) -> str:
    """Minutes and seconds, or hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
