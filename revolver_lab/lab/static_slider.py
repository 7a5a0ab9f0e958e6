"""The slider over morphology with recorded frames: for pages without Python behind them."""

import numpy as np

from revolver_lab.errors import SettingsError
from revolver_lab.evolution.evolution import Evolution
from revolver_lab.lab.facts import total_mass
from revolver_lab.lab.frames import FIT
from revolver_lab.lab.player import Player, make_player
from revolver_lab.lab.standins import open_stage
from revolver_lab.robots.registry import evolution_of

_MOST = 201


def static_slider(
    evolve: Evolution | str,
    frames: int = 41,
    width: int = 480,
    height: int = 360,
    *,
    camera: str | int = FIT,
) -> Player:
    """A slider that drags one robot into another without a kernel or a network.

    Args:
        evolve: The evolution, or the name of a registered one.
        frames: How many robots, evenly from alpha 0 to 1.
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
        camera: A camera of the robot, or "fit".

    Returns:
        What a notebook shows, exported or not; `.save("slider.html")` writes a page. It takes
        less than 3 MB. Where no OpenGL works, its frames are those that were recorded.

    Raises:
        MissingExtraError: If no OpenGL works here and the robot was not recorded.
        SettingsError: If there are too few or too many frames, or the size is not drawable.
        UnknownNameError: If there is no such robot, or it has no such camera.
    """
    evolve = evolution_of(evolve)
    if not isinstance(frames, int) or not 2 <= frames <= _MOST:
        raise SettingsError(f"frames = {frames!r}", f"a whole number from 2 to {_MOST}", "Try 41.")
    alphas = np.linspace(0, 1, frames).tolist()
    with open_stage(evolve, width=width, height=height, camera=camera) as stage:
        pictures = [stage.frame(alpha) for alpha in alphas]
    model, labels = evolve.model(0.0), []
    for alpha in alphas:
        evolve.write_model(model, alpha)
        labels.append(f"alpha {alpha:.3g}, {total_mass(model):.1f} kg")
    changed = int(evolve.theta_changed.sum())
    return make_player(
        pictures, labels, what="alpha",
        alt=f"{evolve.name} on its way from source (alpha 0) to target (alpha 1), in {frames} "
        f"pictures of the standing robot.",
        caption=f"{evolve.name}: {changed} of {len(evolve.theta_names)} parameters change",
    )  # fmt: skip
