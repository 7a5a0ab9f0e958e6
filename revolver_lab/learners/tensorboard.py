"""Event files for TensorBoard, written from what a run's folder holds."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from revolver_lab.errors import MissingExtraError

_FROM_PHASES = ("alpha", "episode_return", "mean_beta", "kept",
                "success", "average", "kl", "log_std", "explained")  # fmt: skip
_EVENTS = "events.out.tfevents.*"


class Curves(Protocol):
    """What is drawn of one learner; see `revolver_lab.runs.so_far.Curves`."""

    method: str
    seed: int
    phases: Sequence[Mapping[str, Any]]
    evaluations: Sequence[tuple[int, float]]


def write_events(folder: str | Path, learners: Iterable[Any]) -> Path:
    """Writes a folder of event files a learner: METHOD/SEED; event files there are written anew.

    Args:
        folder: Where they go.
        learners: Any number of `Curves`.

    Returns:
        The folder.

    Raises:
        MissingExtraError: If tensorboard is not installed.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError as problem:
        raise MissingExtraError(
            f"{problem.name or 'tensorboard'} is missing", "the tensorboard extra",
            "Install it: pip install 'revolver-lab[tensorboard]'.",
        ) from problem  # fmt: skip
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for one in learners:
        place = folder / one.method / str(one.seed)
        for old in place.glob(_EVENTS):  # and nothing else, wherever a link may have led
            old.unlink()
        with SummaryWriter(str(place)) as writer:
            _write(writer, one)
    return folder


def _write(writer: Any, one: Curves) -> None:
    """Writes the numbers of one learner, against its environment steps."""
    for phase in one.phases:
        for name in _FROM_PHASES:
            value = phase.get(name)  # a natural method tells others than Algorithm 1
            if value is not None and math.isfinite(value):
                writer.add_scalar(f"phase/{name}", value, int(phase["steps"]))
    for steps, value in one.evaluations:
        writer.add_scalar("target/mean_return", value, steps)
