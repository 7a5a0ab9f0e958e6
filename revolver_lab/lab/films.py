"""Pictures of a robot along alpha, and of policies side by side, as one image or one film."""

import contextlib
import math
import os
from collections.abc import Generator, Sequence
from pathlib import Path

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.evolution.evolution import Evolution, checked_alpha
from revolver_lab.lab import captions, encoders, gl
from revolver_lab.lab.frames import FIT, Stage
from revolver_lab.lab.rollouts import Rollout, rollouts_of
from revolver_lab.lab.standins import Recorded, open_stage
from revolver_lab.robots.registry import evolution_of

ALPHAS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
_THERE = 2.5
"""Seconds that a film of an evolution takes from alpha 0 to 1, and as many back."""
_HOLD = 0.5
"""Seconds that it rests at either end."""


def strip(
    evolve: Evolution | str,
    alphas: Sequence[float] | float = ALPHAS,
    *,
    path: str | os.PathLike[str] | None = None,
    width: int = 240,
    height: int = 200,
    camera: str | int = FIT,
) -> np.ndarray:
    """A film strip: the robot at each alpha, side by side, all at one scale.

    Args:
        evolve: The evolution, or the name of a registered one.
        alphas: Which robots, in [0, 1].
        path: Where to write it as well (.png, .jpg, .webp).
        width: Width of one picture [pixels].
        height: Height of one picture [pixels].
        camera: A camera of the robot, or "fit".

    Returns:
        The strip, (H, W, 3) uint8.

    Raises:
        AlphaError: If an alpha is outside [0, 1].
        MissingExtraError: If no OpenGL works here and the robot was not recorded.
        SettingsError: If there is no alpha, or the path has another ending.
        UnknownNameError: If there is no such robot, or it has no such camera.
    """
    evolve, robots = evolution_of(evolve), [checked_alpha(each) for each in np.atleast_1d(alphas)]
    if not robots:
        raise SettingsError("no alphas", "at least one in [0, 1]", "Pass alphas=(0, 1).")
    if path is not None:
        encoders.check_path(path, encoders.PICTURES)
    with open_stage(evolve, width=width, height=height, camera=camera) as stage:
        panels = [_panel(stage.frame(alpha), f"alpha {alpha:.3g}", "", alpha) for alpha in robots]
    picture = captions.beside(panels)
    if path is not None:
        encoders.write_picture(picture, path)
    return picture


def film(
    shown: Evolution | str | Rollout | Sequence[Rollout],
    path: str | os.PathLike[str],
    *,
    width: int = 320,
    height: int = 240,
    fps: float = 20,
    speed: float = 1.0,
    camera: str | int = FIT,
) -> Path:
    """A film of an evolution from alpha 0 to 1 and back, or of rollouts side by side.

    Args:
        shown: An evolution, or the name of a registered one; or one or more rollouts (`record`
            makes them).
        path: Where to write it; the ending says how: .gif or .mp4.
        width: Width of one picture [pixels].
        height: Height of one picture [pixels].
        fps: Frames a second, in [1, 50].
        speed: Of rollouts; 1 is real time, 0.5 is half as fast.
        camera: A camera of the robot, or "fit".

    Returns:
        The path written; a film that fails leaves no file.

    Raises:
        MissingExtraError: If no OpenGL works here, or .mp4 is asked for without imageio-ffmpeg.
        SettingsError: If the path or a size cannot work, or there is nothing to show.
        UnknownNameError: If there is no such robot, or it has no such camera.
    """
    checked = encoders.check_path(path, encoders.MOVIES)
    fps, speed = encoders.check_pace(fps, speed)
    gl.ensure()  # a film of recorded pictures would show a robot that only stands
    with contextlib.closing(film_frames(
        shown, width=width, height=height, fps=fps, speed=speed, camera=camera
    )) as frames:  # fmt: skip
        return encoders.write_movie(frames, checked, fps)


def film_frames(
    shown: Evolution | str | Rollout | Sequence[Rollout],
    *,
    width: int = 320,
    height: int = 240,
    fps: float = 20,
    speed: float = 1.0,
    camera: str | int = FIT,
) -> Generator[np.ndarray, None, None]:
    """The frames of `film`, one at a time, (H, W, 3) uint8."""
    size = {"width": width, "height": height, "camera": camera}
    if isinstance(shown, Evolution | str):
        yield from _journey(evolution_of(shown), fps, size)
        return
    rollouts = rollouts_of(shown)
    with contextlib.ExitStack() as opened:
        stages = {
            name: opened.enter_context(open_stage(evolve, **size))
            for name, evolve in {id(run.evolve): run.evolve for run in rollouts}.items()
        }
        length, tick = max(run.seconds for run in rollouts), speed / fps
        for count in range(max(1, math.ceil(length / tick - 1e-6))):
            yield captions.beside(
                [moment(stages[id(run.evolve)], run, count * tick) for run in rollouts]
            )


def _journey(evolve: Evolution, fps: float, size: dict) -> Generator[np.ndarray, None, None]:
    """From alpha 0 to 1 and back, resting at the ends."""
    there = np.linspace(0.0, 1.0, max(2, round(_THERE * fps)))
    rest = np.ones(max(1, round(_HOLD * fps)))
    with Stage(evolve, **size) as stage:
        for alpha in np.concatenate([0 * rest, there, rest, there[::-1]]).tolist():
            yield _panel(stage.frame(alpha), evolve.name, f"alpha {alpha:.2f}", alpha)


def moment(stage: Stage | Recorded, run: Rollout, time: float) -> np.ndarray:
    """One rollout at one time, with what it has achieved by then.

    Args:
        stage: Of the rollout's evolution.
        run: The rollout.
        time: Since its beginning [s].

    Returns:
        A picture above its caption, (H, W, 3) uint8.
    """
    row = run.row(time)
    words = f"alpha {run.alpha:.3g}   {achieved(run, row)}"
    picture = stage.frame(run.alpha, run.qpos[row], places=run.places)
    if not run.title:
        return _panel(picture, words, "", run.alpha)
    under = captions.bar(picture.shape[1], words)
    return np.concatenate([_panel(picture, run.title, "", run.alpha), under])


def achieved(run: Rollout, row: int = -1) -> str:
    """Returns for how long the goal was held by then, in words, or what was earned.

    Args:
        run: The rollout.
        row: Row of its poses, by default the last.
    """
    if run.held is None:
        return f"reward {float(run.rewards[: row % len(run.rewards) + 1].sum()):.4g}"
    if run.held[row] == 0:
        return "goal not held"
    held = int(run.held[row])
    return f"goal held {held} step{'s' * (held != 1)}" + ": success" * run.success(row)


def _panel(picture: np.ndarray, left: str, right: str, alpha: float) -> np.ndarray:
    """A picture above its caption, whose upper edge shows alpha."""
    progress = round(alpha * 200) / 200  # few distinct bars, so that they are drawn once
    return np.concatenate([picture, captions.bar(picture.shape[1], left, right, progress)])
