"""A picture of where a transfer is: its current robot with its current policy, redrawn in place."""

import dataclasses
import time
from pathlib import Path

from revolver_lab.errors import RevolverError
from revolver_lab.natural_log import Iteration
from revolver_lab.policies import Policy
from revolver_lab.robots import registry


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Moment:
    """Where a transfer is.

    Attributes:
        iteration: The latest.
        policy: After it.
    """

    iteration: Iteration
    policy: Policy


class Now:
    """Redraws one picture, now and then; where nothing can be drawn it says so once.

    Args:
        robot: A registered name.
        path: Of the picture.
        every: Seconds between pictures at least [s].
    """

    def __init__(self, robot: str, path: Path, every: float):
        from revolver_lab.lab.frames import Stage

        self._evolve, self._path, self._every = registry.load(robot), path, every
        self._alpha, self._next = -1.0, 0.0
        try:
            self._stage = Stage(self._evolve)
        except RevolverError as error:
            self._stage = None
            print(f"No picture on the way: {error}")
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        print(f"On the way, {path} shows the robot it has come to, and how its policy does.")

    def show(self, moment: Moment) -> bool:
        """Plays and draws an episode, if it is time and alpha has moved.

        Args:
            moment: Where the transfer is.

        Returns:
            Whether it did.
        """
        made = moment.iteration
        if self._stage is None or made.alpha == self._alpha or time.monotonic() < self._next:
            return False
        from revolver_lab.lab import captions, encoders, films
        from revolver_lab.lab.rollouts import record

        title = f"iteration {made.iteration + 1}"
        run = record(moment.policy, self._evolve, made.alpha, title=title)
        pictures = [films.moment(self._stage, run, t * run.seconds) for t in (0.0, 0.2, 1.0)]
        encoders.write_picture(captions.beside(pictures), self._path)
        self._alpha, self._next = made.alpha, time.monotonic() + self._every
        return True

    def __enter__(self) -> "Now":
        return self

    def __exit__(self, *exception: object) -> None:
        if self._stage is not None:
            self._stage.close()
