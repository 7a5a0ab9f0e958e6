"""Checkpoints of a population: written whole or not at all, the one before kept beside it."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from revolver_lab.errors import PolicyFileError
from revolver_lab.natural_population import NaturalPopulation
from revolver_lab.population import Population
from revolver_lab.runs import shapes
from revolver_lab.weights import load_weights, save_weights

_NEXT, _LATEST, _PREVIOUS = (f"checkpoint{word}.safetensors" for word in ("-next", "", "-previous"))
_LARGEST = 1 << 36  # bytes


def save(population: Population | NaturalPopulation, folder: Path) -> None:
    """Writes a checkpoint.

    The new file is complete before the old one is touched: a process killed at any moment, or a
    full disk, leaves one to resume from.

    Args:
        population: Between two ticks.
        folder: Where it goes.

    Raises:
        OSError: If it cannot be written; what was there is still there.
    """
    arrays, plain = population.state()
    save_weights(folder / _NEXT, arrays, {"plain": json.dumps(plain)})
    if (folder / _LATEST).exists():
        os.replace(folder / _LATEST, folder / _PREVIOUS)
    os.replace(folder / _NEXT, folder / _LATEST)


def restore(population: Population | NaturalPopulation, folder: Path) -> bool:
    """Puts the latest intact checkpoint back into a population.

    Args:
        population: Made from the same plan.
        folder: Where checkpoints are.

    Returns:
        Whether there was one; if not, the population begins at its beginning.
    """
    found = _latest(folder)
    if found is None:
        return False
    population.restore(found[0], json.loads(found[1]["plain"]))
    return True


def read_logs(folder: Path) -> list[dict[str, Any]]:
    """Returns the logs of the learners in the latest intact checkpoint, none without one.

    Args:
        folder: Where checkpoints are.

    Raises:
        SettingsError: If it holds something else.
    """
    found = _latest(folder)
    if found is None:
        return []
    try:
        value = json.loads(found[1].get("plain", "null"))
    except (ValueError, RecursionError):
        value = None
    return shapes.check(value, shapes.LOGS, folder / _LATEST)["logs"]


def _latest(folder: Path) -> tuple[dict[str, np.ndarray], dict[str, str]] | None:
    """Reads the latest checkpoint that is whole."""
    for name in (_NEXT, _LATEST, _PREVIOUS):
        try:
            return load_weights(folder / name, largest=_LARGEST)
        except PolicyFileError:  # missing or torn: the one before it will do
            continue
    return None
