"""A picture with words for those who cannot see it; a notebook shows both."""

import base64
import html
import io
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image

from revolver_lab.errors import SettingsError
from revolver_lab.lab.encoders import PICTURES, check_path

_SHOWN = (*PICTURES, ".gif")


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """An image file in memory and its alt text.

    Attributes:
        data: The file.
        kind: Its MIME type, "image/png".
        alt: What it shows, in words.
    """

    data: bytes = field(repr=False)
    kind: str
    alt: str

    def _repr_html_(self) -> str:
        """An image with alt text."""
        words, data = html.escape(self.alt, quote=True), base64.b64encode(self.data).decode()
        return f'<img alt="{words}" style="max-width:100%" src="data:{self.kind};base64,{data}"/>'


def picture(shown: np.ndarray | str | os.PathLike[str], alt: str) -> Picture:
    """Show pixels, or a picture or GIF from a file, in a notebook.

    Args:
        shown: Pixels, (height, width, 3) uint8, such as `strip` returns; or the name of a file.
        alt: What it shows, in words, for those who cannot see it.

    Returns:
        What a notebook displays.

    Raises:
        SettingsError: If there are no words, or what is shown is no picture.

    Example:
        >>> picture(np.zeros((2, 3, 3), dtype=np.uint8), "A black rectangle.").kind
        'image/png'
    """
    if not isinstance(alt, str) or not alt.strip():
        raise SettingsError(f"alt = {alt!r}", "a sentence", "Say what the picture shows.")
    if isinstance(shown, np.ndarray):
        return Picture(data=_png(shown), kind="image/png", alt=alt)
    if not isinstance(shown, str | os.PathLike):
        raise SettingsError(
            f"a picture of type {type(shown).__name__}",
            "pixels, or the name of a file",
            "Pass what rvl.lab.strip returns.",
        )
    path = check_path(Path(shown), _SHOWN)
    if not path.is_file():
        raise SettingsError(f"the file {str(path)!r}", "a file that exists", "Write it first.")
    kind = path.suffix[1:].lower().replace("jpg", "jpeg")
    return Picture(data=path.read_bytes(), kind=f"image/{kind}", alt=alt)


def _png(pixels: np.ndarray) -> bytes:
    """Pixels as a file."""
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != np.uint8:
        raise SettingsError(
            f"pixels of shape {pixels.shape} and type {pixels.dtype}",
            "(height, width, 3) uint8", "Take them from rvl.lab.strip.",
        )  # fmt: skip
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format="png")
    return buffer.getvalue()
