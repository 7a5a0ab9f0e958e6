"""Words under pictures, drawn with the font that pillow brings."""

import functools

import numpy as np
from PIL import Image, ImageDraw, ImageFont

PAPER = (22, 27, 38)
INK = (236, 240, 247)
FAINT = (158, 170, 190)
ACCENT = (255, 176, 84)
GAP = 4
"""Space between panels [pixels]."""


@functools.lru_cache(maxsize=1024)
def bar(width: int, left: str, right: str = "", progress: float | None = None) -> np.ndarray:
    """A dark bar with words at both ends, to put under a picture.

    Args:
        width: Width of the picture [pixels].
        left: Words at the left end, cut short if there is no room.
        right: Words at the right end.
        progress: Share of the bar's upper edge that is lit, such as alpha; None for none.

    Returns:
        (height, width, 3) uint8, read-only, as high as the words need.

    Example:
        >>> bar(320, "expert", "alpha 0.30").shape[1:]
        (320, 3)
    """
    size = max(10, min(17, width // 18))
    font = ImageFont.load_default(size=size)
    picture = Image.new("RGB", (width, int(1.9 * size)), PAPER)
    draw = ImageDraw.Draw(picture)
    middle, edge = picture.height / 2 + 1, size // 2
    taken = draw.textlength(right, font=font) + edge if right else 0
    draw.text((width - edge, middle), right, fill=FAINT, font=font, anchor="rm")
    room = width - taken - 2 * edge
    draw.text((edge, middle), _cut(left, room, font), fill=INK, font=font, anchor="lm")
    if progress is not None:
        draw.rectangle((0, 0, width, 1), fill=(52, 62, 80))
        draw.rectangle((0, 0, round(progress * (width - 1)), 1), fill=ACCENT)
    drawn = np.array(picture)
    drawn.flags.writeable = False
    return drawn


def beside(panels: list[np.ndarray]) -> np.ndarray:
    """Pictures in a row, with a gap between; what is less high has room below."""
    height = max(len(panel) for panel in panels)
    gap = np.full((height, GAP, 3), PAPER, dtype=np.uint8)
    spaced = [part for panel in panels for part in (gap, _deepened(panel, height))][1:]
    return np.concatenate(spaced, axis=1)


def _deepened(panel: np.ndarray, height: int) -> np.ndarray:
    """A picture with paper below it, up to a height."""
    room = np.full((height - len(panel), *panel.shape[1:]), PAPER, dtype=np.uint8)
    return np.concatenate([panel, room]) if len(room) else panel


def _cut(words: str, room: float, font: ImageFont.FreeTypeFont | ImageFont.ImageFont) -> str:
    """Words, with their end replaced by dots if they are wider than `room` pixels."""
    if font.getlength(words) <= room:
        return words
    while words and font.getlength(words + "...") > room:
        words = words[:-1]
    return words + "..."
