"""One worker a shard: a lock that ends with the process that holds it, however it ends."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from revolver_lab.errors import SettingsError
from revolver_lab.runs import store


@contextlib.contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Keeps a second worker away from a shard; the claim ends with the process, however it ends.

    Args:
        folder: The shard's.

    Raises:
        SettingsError: If a worker is at it already.
    """
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        yield
        return
    with open(folder / store.LOCK, "w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as problem:
            raise SettingsError(f"{folder}, which a worker is training", "one worker a shard",
                                "Wait for it, or stop it by run.stop().") from problem  # fmt: skip
        yield


def is_claimed(folder: Path) -> bool:
    """Says whether a worker is at a shard now."""
    try:
        with claimed(folder):
            return False
    except SettingsError:
        return True
