"""Frames into a GIF or an MP4, with what pip installs: pillow, and the ffmpeg of imageio-ffmpeg."""

import itertools
import os
import struct
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
from PIL import GifImagePlugin, Image

from revolver_lab.errors import MissingExtraError, SettingsError
from revolver_lab.files import output_file, write_atomically
from revolver_lab.given import is_number

MOVIES = (".gif", ".mp4")
PICTURES = (".png", ".jpg", ".jpeg", ".webp")

_COLOURS = 255
"""Colours of a GIF; the 256th means "as in the frame before"."""
_AS_BEFORE = 255
_LOOKED_AT = 32
"""Frames from which the one palette of a GIF is chosen."""
_FASTEST_GIF = 50
"""Frames a second that viewers show; they slow down faster ones."""


def check_path(path: str | os.PathLike[str], allowed: tuple[str, ...]) -> Path:
    """A path whose ending is one of `allowed`, in a folder that exists.

    Raises:
        SettingsError: If the ending is another, the folder does not exist, or it is one itself.

    Example:
        >>> check_path("run.gif", MOVIES).name
        'run.gif'
    """
    checked = output_file(path)
    if checked.suffix.lower() not in allowed:
        raise SettingsError(
            f"the file name {checked.name!r}", " or ".join(allowed), "Change its ending."
        )
    if not checked.parent.is_dir():
        raise SettingsError(
            f"the folder {str(checked.parent)!r}", "a folder that exists", "Make it first."
        )
    return checked


def check_pace(fps: float, speed: float = 1.0) -> tuple[float, float]:
    """Return a frame rate that viewers show, and a speed of what is filmed.

    Raises:
        SettingsError: If fps is not in [1, 50], or speed not in [0.05, 20].
    """
    if not is_number(fps) or not 1 <= fps <= _FASTEST_GIF:
        raise SettingsError(f"fps = {fps!r:.80}", f"from 1 to {_FASTEST_GIF}", "Try 20.")
    if not is_number(speed) or not 0.05 <= speed <= 20:
        raise SettingsError(f"speed = {speed!r:.80}", "from 0.05 to 20", "1 is real time.")
    return float(fps), float(speed)


def write_picture(picture: np.ndarray, path: str | os.PathLike[str]) -> Path:
    """Write one picture, whole or not at all.

    Args:
        picture: (height, width, 3) uint8.
        path: Name ending in .png, .jpg or .webp.

    Returns:
        The path written.
    """
    checked = check_path(path, PICTURES)
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / f"picture{checked.suffix}"
        Image.fromarray(picture).save(draft)
        return write_atomically(checked, draft.read_bytes())


def write_movie(frames: Iterable[np.ndarray], path: str | os.PathLike[str], fps: float) -> Path:
    """Write frames as they come, whole or not at all.

    Args:
        frames: Pictures of one size, (height, width, 3) uint8.
        path: Name ending in .gif or .mp4.
        fps: Frames a second, in [1, 50].

    Returns:
        The path written.

    Raises:
        SettingsError: If the ending or the frame rate is not one of these, or there is no frame.
        MissingExtraError: If an MP4 is asked for without imageio-ffmpeg.
    """
    checked = check_path(path, MOVIES)
    check_pace(fps)
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise SettingsError("a film of no frames", "at least one", "Record a step first.")
    pictures = itertools.chain([first], pictures)
    if checked.suffix.lower() == ".gif":
        return write_atomically(checked, b"".join(_gif(pictures, fps)))
    return _mp4(pictures, first.shape, checked, fps)


def _gif(frames: Iterator[np.ndarray], fps: float) -> Iterator[bytes]:
    """Bytes of a GIF: one palette for all, and of each frame only the pixels that changed."""
    head = list(itertools.islice(frames, _LOOKED_AT))
    palette = _palette(head)
    colours = bytes(palette.getpalette() or ()).ljust(3 * 256, b"\0")[: 3 * 256]
    height, width = head[0].shape[:2]
    yield b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0) + colours
    yield b"!\xff\x0bNETSCAPE2.0\x03\x01\0\0\0"  # for ever
    before = None
    for frame in itertools.chain(head, frames):
        flat = Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
        now = np.asarray(flat)
        changed = now if before is None else np.where(now == before, np.uint8(_AS_BEFORE), now)
        before = now
        yield from _gif_frame(changed, duration=1000 / fps)
    yield b";"


def _gif_frame(indices: np.ndarray, duration: float) -> list[bytes]:
    """One frame of a GIF: its header and its pixels, (height, width) uint8, compressed."""
    height, width = indices.shape
    picture = Image.frombytes("P", (width, height), indices.tobytes())
    return GifImagePlugin.getdata(picture, duration=duration, transparency=_AS_BEFORE, disposal=1)


def _palette(frames: list[np.ndarray]) -> Image.Image:
    """The colours that show these frames best."""
    seen = np.concatenate([frame[::2, ::2] for frame in frames[:: max(1, len(frames) // 8)]])
    return Image.fromarray(seen).quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)


def _mp4(frames: Iterator[np.ndarray], shape: tuple[int, ...], path: Path, fps: float) -> Path:
    """Pipe frames to the ffmpeg that imageio-ffmpeg brings; players want even sides."""
    ffmpeg = ffmpeg_module()
    height, width = shape[0] + shape[0] % 2, shape[1] + shape[1] % 2
    edge = ((0, height - shape[0]), (0, width - shape[1]), (0, 0))
    settings = ["-crf", "20", "-movflags", "+faststart"]
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "film.mp4"
        pipe = ffmpeg.write_frames(
            str(draft), (width, height), fps=fps, codec="libx264", quality=None,
            macro_block_size=2, ffmpeg_log_level="error", output_params=settings,
        )  # fmt: skip
        pipe.send(None)
        for frame in frames:
            pipe.send(np.ascontiguousarray(np.pad(frame, edge, mode="edge")))
        pipe.close()
        return write_atomically(path, draft.read_bytes())


def ffmpeg_module() -> ModuleType:
    """The module imageio_ffmpeg, with an ffmpeg that it can run.

    Raises:
        MissingExtraError: If it is not installed, or brings no ffmpeg for this platform.
    """
    try:
        import imageio_ffmpeg

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as problem:
        raise MissingExtraError(
            f"no ffmpeg for an .mp4 ({problem})",
            "imageio-ffmpeg, or a .gif instead",
            "pip install imageio-ffmpeg",
        ) from problem
    return imageio_ffmpeg
