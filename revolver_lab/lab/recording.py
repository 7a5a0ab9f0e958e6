"""Makes the shipped recordings: `python -m revolver_lab.lab.recording [NAME ...]`."""

import io
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from revolver_lab.errors import SettingsError
from revolver_lab.evolution.evolution import Evolution
from revolver_lab.files import asset_folder, write_atomically
from revolver_lab.lab.frames import Stage
from revolver_lab.lab.standins import HEIGHT, WIDTH
from revolver_lab.robots import registry

FRAMES = 21
"""Frames of a recording, evenly from alpha 0 to 1."""
_QUALITY = 75
_HIGHEST = 16383
"""Height of the highest picture that WebP has [pixels]."""


def record_frames(evolve: Evolution, path: str | os.PathLike[str], frames: int = FRAMES) -> Path:
    """Draw a recording and write it, whole or not at all.

    Args:
        evolve: The evolution.
        path: Name ending in .webp; frames stand one above the other.
        frames: How many, evenly from alpha 0 to 1.

    Returns:
        The path written.

    Raises:
        MissingExtraError: If no OpenGL works here.
        SettingsError: If there are too few frames, too many for one file, or it is no .webp.
    """
    limit = _HIGHEST // HEIGHT
    if not 2 <= frames <= limit:
        raise SettingsError(f"{frames} frames", f"from 2 to {limit}", f"Try {FRAMES}.")
    if Path(path).suffix != ".webp":
        raise SettingsError(f"the file name {str(path)!r}", "a .webp", "Change its ending.")
    with Stage(evolve, width=WIDTH, height=HEIGHT) as stage:
        pictures = [stage.frame(alpha) for alpha in np.linspace(0, 1, frames).tolist()]
    buffer = io.BytesIO()
    Image.fromarray(np.concatenate(pictures)).save(buffer, "WEBP", quality=_QUALITY, method=6)
    return write_atomically(Path(path), buffer.getvalue())


def main(names: list[str]) -> None:
    """Record robots into the shipped folder, by default all that are registered.

    Args:
        names: Registered robots.
    """
    for name in names or registry.names():
        print(record_frames(registry.load(name), asset_folder("frames") / f"{name}.webp"))


if __name__ == "__main__":
    main(sys.argv[1:])
