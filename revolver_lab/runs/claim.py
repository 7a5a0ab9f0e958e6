"""One worker a shard: a lock that ends with the process that holds it, however it ends."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import IO

from revolver_lab.errors import SettingsError
from revolver_lab.runs import store


class ShardTakenError(SettingsError):
    """A worker is at the shard already."""


@contextlib.contextmanager
def claimed(folder: Path, patience: float = 0.0) -> Iterator[None]:
    """Keeps a second worker away from a shard; the claim ends with the process, however it ends.

    Args:
        folder: The shard's.
        patience: How long to wait for it [s].

    Raises:
        ShardTakenError: If a worker is at it already.
    """
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        yield
        return
    with open(folder / store.LOCK, "w") as file:
        until = time.monotonic() + patience
        while not _locked(file, fcntl):
            if time.monotonic() >= until:
                raise ShardTakenError(f"{folder}, which a worker is training", "one worker a shard",
                                      "Wait for it, or stop it by run.stop().")  # fmt: skip
            time.sleep(0.02)
        yield


def _locked(file: IO[str], fcntl: ModuleType) -> bool:
    """Locks a file, or says that somebody else has."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def is_claimed(folder: Path) -> bool:
    """Says whether a worker is at a shard now."""
    try:
        with claimed(folder):
            return False
    except ShardTakenError:
        return True
