"""Importing the package against importing what it cannot do without."""

import subprocess
import sys

from benchmarks.timing import paired, row


def _import(what: str) -> None:
    subprocess.run([sys.executable, "-c", f"import {what}"], check=True)


def run() -> list[dict[str, object]]:
    """Whole processes in turn, interpreter start included on both sides."""
    timing = paired(lambda: _import("revolver_lab"), lambda: _import("numpy, mujoco"), 15)
    return [
        row(
            "import revolver_lab",
            "import numpy, mujoco",
            "<= 1.5",
            timing["ratio"],
            f"{timing['ours_s']:.3f} s against {timing['peer_s']:.3f} s, whole processes",
        )
    ]
