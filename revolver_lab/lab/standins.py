"""Recorded pictures that stand in for live ones where no OpenGL works, and the stages in use."""

import functools
from collections import OrderedDict
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from revolver_lab import _gl
from revolver_lab.evolution.evolution import Evolution, checked_alpha
from revolver_lab.files import asset_folder
from revolver_lab.lab import captions, gl
from revolver_lab.lab.frames import FIT, Stage

WIDTH, HEIGHT = 320, 240
"""Size of a recorded frame [pixels]."""
NOTE = "recorded picture: no OpenGL works here"
_AT_ONCE = 4
"""Stages kept open for explorers; a notebook of more robots opens the older ones again."""


class Recorded:
    """Shows recorded frames through the interface of a `Stage`.

    Every picture says that it is recorded. Poses and cameras are not in it: the robot stands.

    Args:
        pictures: The recording, (n, HEIGHT, WIDTH, 3) uint8, evenly from alpha 0 to 1; None
            shows an empty panel with the reason.
        width: Width of a frame [pixels].
        height: Height of a frame [pixels].
    """

    def __init__(self, pictures: np.ndarray | None, *, width: int = 480, height: int = 360):
        self._pictures, self._size, self.alpha = pictures, (width, height), 0.0

    def frame(
        self,
        alpha: float | None = None,
        qpos: np.ndarray | None = None,
        camera: str | int | None = None,
        places: np.ndarray | None = None,
    ) -> np.ndarray:
        """The nearest recorded picture, (height, width, 3) uint8; only `alpha` is used.

        Raises:
            AlphaError: If alpha is outside [0, 1].
        """
        self.alpha = self.alpha if alpha is None else checked_alpha(alpha)
        width, height = self._size
        canvas = Image.new("RGB", self._size, captions.PAPER)
        if self._pictures is None:
            _write(canvas, "No picture: no OpenGL works here,\nand this robot was not recorded.")
            return np.asarray(canvas)
        index = round(self.alpha * (len(self._pictures) - 1))
        picture = Image.fromarray(self._pictures[index])
        scale = min(width / picture.width, height / picture.height)
        picture = picture.resize((round(picture.width * scale), round(picture.height * scale)))
        canvas.paste(picture, ((width - picture.width) // 2, (height - picture.height) // 2))
        shown = np.array(canvas)
        under = captions.bar(width, NOTE)
        shown[-len(under) :] = under
        return shown

    def resize(self, width: int, height: int) -> None:
        """Show at another size from now on."""
        self._size = (width, height)

    def effects(self, shown: bool) -> None:
        """Nothing to do: shadows and reflections are recorded."""

    def close(self) -> None:
        """Nothing to free."""

    def __enter__(self) -> "Recorded":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def open_stage(
    evolve: Evolution, *, width: int = 480, height: int = 360, camera: str | int = FIT
) -> Stage | Recorded:
    """A stage where OpenGL works, else the robot's recording.

    Args:
        evolve: The evolution.
        width: Width of a frame [pixels].
        height: Height of a frame [pixels].
        camera: A camera of the robot, or "fit".

    Raises:
        MissingExtraError: If no OpenGL works here and the robot was not recorded.
    """
    if not _gl.choose().works:
        pictures = recording(evolve.name)
        if pictures is not None:
            return Recorded(pictures, width=width, height=height)
        gl.ensure()  # raises, with the line that mends it
    return Stage(evolve, width=width, height=height, camera=camera)


_shared: "OrderedDict[Evolution, Stage | Recorded]" = OrderedDict()


def shared_stage(evolve: Evolution) -> Stage | Recorded:
    """The one long-lived stage of an evolution; cells run again do not open another.

    Edges are jagged in it, which halves the time of a frame on software GL; a picture that is to
    look better is drawn larger and reduced. Where no OpenGL works and nothing was recorded its
    pictures are empty and say so.
    """
    if evolve not in _shared:
        missing = not _gl.choose().works
        _shared[evolve] = Recorded(recording(evolve.name)) if missing else Stage(evolve, samples=0)
        while len(_shared) > _AT_ONCE:
            _shared.popitem(last=False)[1].close()
    _shared.move_to_end(evolve)
    return _shared[evolve]


@functools.lru_cache(maxsize=8)
def recording(name: str) -> np.ndarray | None:
    """The shipped recording of a robot, (n, HEIGHT, WIDTH, 3) uint8, read-only; None if none.

    Example:
        >>> recording("cheetah-front-leg").shape
        (21, 240, 320, 3)
    """
    path = asset_folder("frames") / f"{name}.webp"
    if Path(name).name != name or not path.is_file():
        return None
    with Image.open(path) as strip:
        pixels = np.array(strip.convert("RGB"))
    pixels.flags.writeable = False
    return pixels.reshape(-1, HEIGHT, WIDTH, 3)


def _write(canvas: Image.Image, words: str) -> None:
    """Words in the middle of a panel."""
    font = ImageFont.load_default(size=max(10, canvas.width // 28))
    middle = (canvas.width / 2, canvas.height / 2)
    ImageDraw.Draw(canvas).multiline_text(
        middle, words, fill=captions.INK, font=font, anchor="mm", align="center"
    )
