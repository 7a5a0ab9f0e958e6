"""Policies side by side under one play button: several on one robot, or one along alpha."""

import contextlib
from collections.abc import Sequence

from revolver_lab.lab.encoders import check_pace
from revolver_lab.lab.films import film_frames
from revolver_lab.lab.frames import FIT
from revolver_lab.lab.player import Player, make_player
from revolver_lab.lab.rollouts import Rollout, rollouts_of


def compare(
    rollouts: Sequence[Rollout],
    *,
    width: int = 300,
    height: int = 225,
    fps: float = 12.5,
    speed: float = 1.0,
    camera: str | int = FIT,
) -> Player:
    """Rollouts side by side, with one slider over time and one play button.

    Args:
        rollouts: What `record` made: of several policies on one robot, or of one along alpha.
        width: Width of one picture [pixels].
        height: Height of one picture [pixels].
        fps: Frames a second, in [1, 50].
        speed: In [0.05, 20]; 1 is real time, 0.5 is half as fast.
        camera: A camera of the robot, or "fit".

    Returns:
        What a notebook shows, exported or not; `.save("compare.html")` writes a page. Where no
        OpenGL works, the recorded robots stand while their rewards go on.

    Raises:
        MissingExtraError: If no OpenGL works here and a robot was not recorded.
        SettingsError: If there is nothing to show, or too much for one page, or fps or speed
            cannot work.

    Example:
        >>> import revolver_lab as rvl
        >>> evolve, expert = rvl.load("cheetah-front-leg"), rvl.load_expert("cheetah-front-leg")
        >>> runs = [rvl.lab.record(expert, evolve, alpha, steps=2) for alpha in (0.0, 1.0)]
        >>> compare(runs).title
        'cheetah-front-leg: alpha 0, alpha 1'
    """
    runs, (fps, speed) = rollouts_of(rollouts), check_pace(fps, speed)
    with contextlib.closing(
        film_frames(runs, width=width, height=height, fps=fps, speed=speed, camera=camera)
    ) as film:
        frames = list(film)
    names = [run.title or f"alpha {run.alpha:.3g}" for run in runs]
    robots = ", ".join(dict.fromkeys(run.evolve.name for run in runs))
    earned = [f"{name} earned {run.score:.4g}" for name, run in zip(names, runs)]
    return make_player(
        frames, [f"{count * speed / fps:.1f} s" for count in range(len(frames))], what="time",
        alt=f"Film of {robots}, side by side: {'; '.join(earned)}.",
        caption=f"{robots}: {', '.join(names)}", pause=1000 / fps,
    )  # fmt: skip
