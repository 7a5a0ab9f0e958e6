"""The vector door's bookkeeping: infos with masks as gymnasium has them, and checked settings."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from revolver_lab.errors import SettingsError
from revolver_lab.evolution.evolution import checked_alpha
from revolver_lab.given import seed_of


def masked(values: Mapping[str, Any], mask: np.ndarray) -> dict[str, Any]:
    """Return infos as gymnasium batches them: each key with a "_key" that says whose it is.

    Args:
        values: Key -> (n, ...) array, or a dict of such.
        mask: Which simulations have these infos, (n,) bool; elsewhere the values are 0.

    Example:
        >>> masked({"alpha": np.array([0.1, 0.2])}, np.array([True, False]))
        {'alpha': array([0.1, 0. ]), '_alpha': array([ True, False])}
    """
    infos: dict[str, Any] = {}
    for key, value in values.items():
        nested = isinstance(value, Mapping)
        infos[key] = masked(value, mask) if nested else np.where(mask, value, np.zeros_like(value))
        infos[f"_{key}"] = mask.copy()
    return infos


def objects(rows: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return an (n,) object array of copies of the rows where ``mask``, None elsewhere."""
    out = np.full(len(rows), None, dtype=object)
    for i in np.flatnonzero(mask):
        out[i] = rows[i].copy()
    return out


def seeds_of(seeds: Sequence[int], n: int) -> list[int | None]:
    """Return the seeds of equal groups of n simulations.

    Raises:
        SettingsError: If the simulations cannot be parted so, or a seed is no whole number.

    Example:
        >>> seeds_of([3, 5], 4)
        [3, 5]
    """
    found = [seed_of(seed) for seed in seeds]
    if not found or n % len(found):
        raise SettingsError(f"seeds = {list(seeds)} for {n} simulations", "whole numbers of 0 and "
                            f"more, as many as divide {n}", "Give one seed a group.")  # fmt: skip
    return [*found]


def alphas_of(alphas: float | Sequence[float] | np.ndarray, n: int) -> np.ndarray:
    """Return n checked alphas, (n,) float64.

    Args:
        alphas: One for all, or n of them.
        n: How many simulations there are.

    Raises:
        AlphaError: If one is not in [0, 1].
        SettingsError: If there are neither one nor n.

    Example:
        >>> alphas_of(0.5, 2)
        array([0.5, 0.5])
    """
    given = np.asarray(alphas)
    if given.shape not in ((), (n,)):
        raise SettingsError(
            f"alphas of shape {given.shape}", f"one alpha, or shape ({n},)", "Give one each."
        )
    return np.array([checked_alpha(alpha) for alpha in np.broadcast_to(given, (n,))], dtype=float)


def mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """Return a supported autoreset mode.

    Raises:
        SettingsError: If it is not one of gymnasium's, or "Disabled".

    Example:
        >>> mode_of("SameStep")
        <AutoresetMode.SAME_STEP: 'SameStep'>
    """
    supported = {m.value: m for m in (AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP)}
    value = mode.value if isinstance(mode, AutoresetMode) else mode
    if not isinstance(value, str) or value not in supported:
        raise SettingsError(
            f"autoreset_mode = {mode!r}",
            " or ".join(map(repr, supported)),
            "Simulations restart by themselves here; choose when.",
        )
    return supported[value]
