"""Terrains along a path: height fields of as many points, whose heights move."""

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.evolution.canonical import Pairs, elements


def align_terrains(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    pairs: Pairs,
    models: tuple[mujoco.MjModel, mujoco.MjModel],
) -> list[tuple[str, str]]:
    """Pair the height fields of paired geoms, and write out their heights where they differ.

    Args:
        source: A canonical robot, changed in place.
        target: The other one, changed in place.
        pairs: Paired geoms, under "geom".
        models: Both, compiled.

    Returns:
        (height field's name in source, name in target).

    Raises:
        ParameterError: If two have other numbers of points, or only one of them is flat.
    """
    geoms = elements(source, "geom"), elements(target, "geom")
    paired = {
        geoms[0][a].hfieldname: geoms[1][b].hfieldname
        for a, b in pairs.get("geom", [])
        if geoms[0][a].hfieldname
    }
    ours, theirs = elements(source, "hfield"), elements(target, "hfield")
    for name, other in paired.items():
        heights = _heights(models[0], name), _heights(models[1], other)
        if heights[0].shape == heights[1].shape and np.array_equal(*heights):
            continue
        if heights[0].shape != heights[1].shape or heights[0].any() != heights[1].any():
            told = (f"{h.shape} points{'' if h.any() else ', all of one height'}" for h in heights)
            raise ParameterError(
                f"terrain {name!r} of {', and of '.join(told)}",
                "as many points in both, and both flat or neither",
                "Sample one terrain as the other, or raise a point of the flat one a little.",
            )
        for terrain, values in zip((ours[name], theirs[other]), heights):
            terrain.file, terrain.content_type = "", ""
            terrain.nrow, terrain.ncol = values.shape
            terrain.userdata = values.ravel()
    return list(paired.items())


def _heights(model: mujoco.MjModel, name: str) -> np.ndarray:
    """Heights of a terrain's points over its lowest, as parts of the highest's, (rows, columns)."""
    view = model.hfield(name)
    shape, first = (int(view.nrow[0]), int(view.ncol[0])), int(view.adr[0])
    return model.hfield_data[first : first + shape[0] * shape[1]].reshape(shape).copy()
