"""One worker a shard: a lock that ends with the process that holds it, however it ends."""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from revolver_lab.errors import SettingsError
from revolver_lab.runs import store


class ShardTakenError(SettingsError):
    """A shard that another worker is training."""


@contextlib.contextmanager
def claimed(folder: Path, patience: float = 0.0) -> Iterator[None]:
    """Keeps a second worker away from a folder; the claim ends with the process, however it ends.

    Args:
        folder: A shard's, or that of all shards.
        patience: How long to wait for another's claim to end [s]; whoever only looks whether
            a worker is there claims the folder for a moment, too.

    Raises:
        ShardTakenError: If a worker is at it already.
        FileNotFoundError: If there is no such folder.
    """
    until = time.monotonic() + patience
    with open(folder / store.LOCK, "w") as file:
        while not _lock(file):
            if time.monotonic() >= until:
                raise ShardTakenError(f"{folder}, which a worker is training", "one worker a shard",
                              "Wait for it, or stop it by run.stop().")  # fmt: skip
            time.sleep(0.05)
        yield


def _lock(file: IO[str], shared: bool = False) -> bool:
    """Takes the lock if it is free, for oneself or together with others who only look."""
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        return True
    try:
        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def is_claimed(folder: Path) -> bool:
    """Says whether a worker is at a shard now; looking writes nothing."""
    try:
        with open(folder / store.LOCK) as file:
            return not _lock(file, shared=True)
    except FileNotFoundError:  # nobody has begun, or it is done, and cleared away
        return False
