"""What an explorer shows, without any widget: alpha, camera and time in, picture and facts out."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from revolver_lab import _gl
from revolver_lab.errors import SettingsError
from revolver_lab.evolution.evolution import Evolution, checked_alpha
from revolver_lab.lab.facts import Fact, Facts
from revolver_lab.lab.frames import FIT
from revolver_lab.lab.rollouts import Acting, Rollout, playable, record
from revolver_lab.lab.standins import NOTE, shared_stage
from revolver_lab.robots.registry import evolution_of

if TYPE_CHECKING:
    from revolver_lab.tasks.base import Task

QUICK, FULL = (320, 240), (640, 480)
"""Pixels of a picture while the slider moves, and when it rests."""
_FINER = 1.5
"""A full picture is drawn that much larger and then reduced, which smooths its edges."""
_JPEG_QUALITY = 85


@dataclass(frozen=True, kw_only=True)
class Shot:
    """One picture of an explorer, ready to be shown.

    Attributes:
        jpeg: The file.
        alt: What it shows, in words.
        words: A line to put under it.
    """

    jpeg: bytes = field(repr=False)
    alt: str
    words: str


class Explorer:
    """One robot on its way from source to target, and what a policy does on it.

    Args:
        evolve: The evolution, or the name of a registered one.
        policy: Observation (O,) -> action (A,) in [-1, 1]; by default the robot stands.
        task: What the policy is judged by: a reward of the registered robot, by default its first,
            or a task for an evolution of your own.
        seed: Seed of the policy's episodes.

    Raises:
        SettingsError: If the robot or the policy is something else.
        UnknownNameError: If there is no robot of that name.
    """

    def __init__(
        self,
        evolve: Evolution | str,
        policy: Acting | None = None,
        *,
        task: "str | Task | None" = None,
        seed: int = 0,
    ):
        self.evolve = evolve = evolution_of(evolve)
        self.policy = policy
        if policy is not None:
            playable(policy, evolve, 0.0, task)  # what cannot be played is told now
        self._task, self._seed = task, seed
        self._facts = Facts(evolve)
        self._rollout: Rollout | None = None
        model = evolve.model(0.0)
        names = [model.camera(index).name for index in range(model.ncam)]
        self.live = _gl.choose().works
        self.cameras: Sequence[str] = (FIT, *names) if self.live else (FIT,)

    def picture(
        self, alpha: float, camera: str = FIT, *, step: int | None = None, full: bool = True
    ) -> Shot:
        """Draw E(alpha), standing, or where the policy has brought it.

        Args:
            alpha: Evolution parameter in [0, 1].
            camera: One of `cameras`.
            step: Step of the policy's episode; None for the standing robot.
            full: In full resolution with shadows and reflections, instead of the quick one.

        Raises:
            AlphaError: If alpha is outside [0, 1].
            SettingsError: If a step is asked for without a policy.
            UnknownNameError: If there is no such camera.
        """
        alpha = checked_alpha(alpha)
        stage = shared_stage(self.evolve)
        size = FULL if full else QUICK
        finer = _FINER if full and self.live else 1
        stage.resize(*(round(side * finer) for side in size))
        stage.effects(full)
        words, pose, places = f"alpha {alpha:.2f}", None, None
        if step is not None:
            run = self.rollout(alpha)
            step = min(step, len(run.rewards) - 1)
            earned = float(run.rewards[: step + 1].sum())
            pose, places = run.qpos[step], run.places
            words += f", {step * run.dt:.1f} s, reward {earned:.4g} of {run.score:.4g}"
        pixels = stage.frame(alpha, pose, camera, places)
        note = "" if self.live else f" ({NOTE})"
        doing = "standing" if pose is None or not self.live else "as its policy moves it"
        alt = f"{self.evolve.name}, {doing}, {words}, camera {camera}{note}"
        return Shot(jpeg=_jpeg(pixels, size), alt=alt, words=words + note)

    def rollout(self, alpha: float) -> Rollout:
        """The policy's episode on E(alpha); the last one is kept.

        Raises:
            SettingsError: If there is no policy.
        """
        if self.policy is None:
            raise SettingsError("no policy", "a policy", "Pass one to explore(evolve, policy).")
        if self._rollout is None or self._rollout.alpha != alpha:
            self._rollout = record(
                self.policy, self.evolve, alpha, task=self._task, seed=self._seed
            )
        return self._rollout

    def facts(self, alpha: float) -> list[Fact]:
        """Total mass, limb lengths and the parameters that change, at alpha."""
        return self._facts.at(alpha)


def _jpeg(pixels: np.ndarray, size: tuple[int, int]) -> bytes:
    """A picture, (height, width, 3) uint8, as a JPEG file of a size [pixels]."""
    picture, buffer = Image.fromarray(pixels), io.BytesIO()
    if picture.size != size:
        picture = picture.resize(size, Image.Resampling.BOX)
    picture.save(buffer, "JPEG", quality=_JPEG_QUALITY)
    return buffer.getvalue()
