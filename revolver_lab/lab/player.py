"""Recorded frames under a slider, as one HTML fragment that needs no kernel and no network."""

import base64
import functools
import html
import io
import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image

from revolver_lab.errors import SettingsError
from revolver_lab.files import write_atomically
from revolver_lab.lab.encoders import check_path

MAX_BYTES = 2_900_000
"""Largest fragment [bytes]; the quality of the frames is lowered until it fits."""
_QUALITIES = (82, 70, 55, 40, 25)
"""Qualities of WebP, best first."""
_HEAD = "data:image/webp;base64,"


@dataclass(frozen=True, kw_only=True, eq=False)
class Player:
    """A slider over recorded frames; a notebook shows it, and so does an exported one.

    The slider is the browser's own, so arrow keys, Home and End move it. Nothing moves by itself,
    and readers who ask their system for less motion get no play button.

    Attributes:
        fragment: HTML with its frames, style and script inside; a page may hold several.
        title: What it shows, in a few words.
    """

    fragment: str = field(repr=False)
    title: str

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write a page of its own, whole or not at all.

        Args:
            path: Name ending in .html.

        Returns:
            The path written.

        Raises:
            SettingsError: If the ending is another, or the folder does not exist.
        """
        checked = check_path(path, (".html",))
        return write_atomically(checked, _PAGE.format(html.escape(self.title), self.fragment))

    def _repr_html_(self) -> str:
        """The fragment; Jupyter asks for it."""
        return self.fragment


def make_player(
    frames: Sequence[np.ndarray],
    labels: Sequence[str],
    *,
    what: str,
    alt: str,
    caption: str,
    pause: float = 60,
    max_bytes: int = MAX_BYTES,
) -> Player:
    """Put frames under a slider.

    Args:
        frames: Pictures of one size, (height, width, 3) uint8.
        labels: What to say of each.
        what: What the slider moves, such as "alpha".
        alt: What the pictures show, in words.
        caption: A line to put under the slider.
        pause: Time from one frame to the next while it plays [ms].
        max_bytes: Largest fragment.

    Raises:
        SettingsError: If there is no frame, or the frames cannot be made so small.
    """
    if not len(frames) or len(frames) != len(labels):
        raise SettingsError(
            f"{len(frames)} frames and {len(labels)} labels", "as many of both, at least one",
            "Pass one label for each frame.",
        )  # fmt: skip
    for quality in _QUALITIES:
        files = [_webp(frame, quality) for frame in frames]
        if sum(map(len, files)) < max_bytes - 10_000:
            break
    else:
        raise SettingsError(
            f"{len(frames)} frames of {frames[0].shape[1]} x {frames[0].shape[0]}",
            f"what fits into {max_bytes / 1e6:.1f} MB", "Take fewer or smaller frames.",
        )  # fmt: skip
    height, width = frames[0].shape[:2]
    data = {"head": _HEAD, "pause": pause, "labels": list(labels), "frames": files}
    text = {
        "WIDTH": str(width), "HEIGHT": str(height), "LAST": str(len(frames) - 1),
        "ALT": html.escape(alt), "WHAT": html.escape(what), "CAPTION": html.escape(caption),
        "LABEL": html.escape(labels[0]), "FIRST": _HEAD + files[0],
        "DATA": json.dumps(data).replace("<", "\\u003c"),
    }  # fmt: skip
    fragment = re.sub(rf"\b({'|'.join(text)})\b|\bWIDTH(?=px)", lambda m: text[m[0]], _template())
    return Player(fragment=fragment, title=caption)


def _webp(frame: np.ndarray, quality: int) -> str:
    """A frame as base64 text of a WebP file."""
    buffer = io.BytesIO()
    Image.fromarray(frame).save(buffer, "WEBP", quality=quality, method=3)
    return base64.b64encode(buffer.getvalue()).decode()


@functools.cache
def _template() -> str:
    """The fragment, with words in capitals where something is to be put."""
    return (Path(__file__).parent / "player.html").read_text(encoding="utf-8")


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{}</title>
<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,"></head><body style="margin:1em auto;padding:0 1em;max-width:64em">
{}
</body></html>
"""
