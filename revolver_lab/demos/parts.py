"""What demonstrations share: arguments, runs side by side on a core each, pictures, last words."""

import argparse
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from revolver_lab.errors import RevolverError

Board = Any
"""A dict that several processes share: name -> the latest that was put there."""

_POLL = 0.5  # [s]


def read_options(
    about: str | None, program: str, out: str, steps: int, arguments: Sequence[str] | None
) -> argparse.Namespace:
    """Returns `out`, `seed` and `steps`.

    Args:
        about: What is demonstrated.
        program: The module's name.
        out: Folder for the files, where nothing else is said.
        steps: Environment steps of each learner, likewise [steps].
        arguments: Of the command line; None takes the process's own.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {program}", description=about)
    parser.add_argument("--out", type=Path, default=Path(out), help=f"folder for files ({out})")
    parser.add_argument("--seed", type=int, default=0)
    words = f"environment steps of each learner, at most ({steps})"
    parser.add_argument("--steps", type=int, default=steps, help=words)
    return parser.parse_args(arguments)


def side_by_side(
    jobs: Mapping[str, Callable[[Board], Any]], look: Callable[[Mapping[str, Any]], None]
) -> dict[str, Any]:
    """Runs each job in a process of its own, with one thread.

    Args:
        jobs: Name -> what to do; it is handed the board.
        look: Called about twice a second with what is on the board, once there is something.

    Returns:
        Name -> what the job returned.
    """
    os.environ["OMP_NUM_THREADS"] = "1"  # handed down: each process has a core, and no more
    context = multiprocessing.get_context("spawn")
    with context.Manager() as manager, ProcessPoolExecutor(len(jobs), context) as pool:
        board = manager.dict()
        runs = {name: pool.submit(job, board) for name, job in jobs.items()}
        while wait(runs.values(), timeout=_POLL).not_done:
            seen = dict(board)
            if seen:
                look(seen)
        return {name: run.result() for name, run in runs.items()}


def draw(make: Callable[[Path], list[Path]], out: Path) -> list[Path]:
    """Makes pictures; where nothing can be drawn, says how to mend that.

    Args:
        make: Makes them in a folder that exists, and returns their names.
        out: The folder.
    """
    out.mkdir(parents=True, exist_ok=True)
    try:
        return make(out)
    except RevolverError as error:
        print(f"No film: {error}")
        return []


@contextmanager
def timed(files: list[Path]) -> Iterator[None]:
    """Says at the end how long it took, and what was written.

    Args:
        files: Names, which may be added while it lasts.
    """
    started = time.monotonic()
    yield
    minutes, seconds = divmod(round(time.monotonic() - started), 60)
    print(f"Done in {minutes} min {seconds} s. Files written:")
    print("\n".join(f"  {path}" for path in files))


def written(out: Path, names: Sequence[str]) -> list[Path]:
    """Returns the files in some folders of a folder."""
    return sorted(path for name in names for path in (out / name).iterdir())
