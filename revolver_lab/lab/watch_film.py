"""The policy that a run has now, filmed on the robot that it has come to, a frame at a time."""

import dataclasses
import tempfile
import time
from collections.abc import Generator
from pathlib import Path

import numpy as np

from revolver_lab.errors import PolicyFileError
from revolver_lab.evolution.evolution import Evolution
from revolver_lab.lab.encoders import write_movie
from revolver_lab.lab.films import achieved
from revolver_lab.lab.pictures import Picture, picture
from revolver_lab.lab.rollouts import Rollout, record
from revolver_lab.lab.standins import NOTE, Recorded, shared_stage
from revolver_lab.policies import Policy
from revolver_lab.robots import registry
from revolver_lab.runs import LearnerStatus, Run, Status, store

EVERY = 25.0
"""Seconds between films; software GL draws about 25 frames a second, and training goes on."""
WIDTH, HEIGHT = 240, 180
"""Size of a film [pixels]."""
FPS = 10
_STEPS = 100  # of an episode; 5 s of a cheetah
_SLOWLY = 0.5  # speed of an episode that has a goal: they are short, and filmed whole


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scene:
    """What could be filmed now.

    Attributes:
        path: The policy's file.
        changed: When it was written [ns].
        learner: Whose it is.
    """

    path: Path
    changed: int
    learner: LearnerStatus


class Filming:
    """Films the newest policy of a run now and then.

    Args:
        run: The run.
        every: Seconds between films [s]; None is `EVERY`.
    """

    def __init__(self, run: Run, every: float | None = None):
        self._run, self.every = run, EVERY if every is None else every
        self._filmed: Scene | None = None
        self._next = 0.0
        self._evolve: Evolution | None = None

    def due(self, status: Status) -> Scene | None:
        """Returns what to film now; None where it is too early, or nothing is new.

        Args:
            status: How the run is doing.
        """
        finished = status.state == "finished"
        if time.monotonic() < self._next and not finished:
            return None
        scene = scene_of(self._run, status)
        before = self._filmed
        if scene is None or (before and (scene.path, scene.changed, scene.learner.alpha) == (
                before.path, before.changed, before.learner.alpha)):  # fmt: skip
            return None
        return scene

    def shoot(self, scene: Scene) -> Generator[None, None, Picture | None]:
        """Films a scene; it pauses after each frame, so that others get their turn.

        Args:
            scene: What `due` returned.

        Returns:
            A GIF, or a still recorded picture where no OpenGL works; None where the policy has
            gone meanwhile.
        """
        self._filmed, self._next = scene, time.monotonic() + self.every
        try:
            policy = Policy.load(scene.path)
        except PolicyFileError:
            if scene.path.exists():
                raise
            return None
        plan, one = self._run.plan, scene.learner
        self._evolve = self._evolve or registry.load(plan.robot)
        yield
        task = registry.get(plan.robot).make_task(plan.task)
        take = record(policy, self._evolve, one.alpha, task=plan.task, seed=one.seed,
                      steps=_STEPS if task.goal_steps is None else None)  # fmt: skip
        yield
        frames: list[np.ndarray] = []
        for frame in _frames(take):
            frames.append(frame)
            yield
        shown = _as_gif(frames, _words(take, one, len(frames)))
        self._next = time.monotonic() + self.every
        return shown


def scene_of(run: Run, status: Status) -> Scene | None:
    """Returns the newest policy of a run; None where there is none yet.

    Args:
        run: The run.
        status: How it is doing.
    """
    found = []
    for one in status.learners:
        path = run.folder / store.POLICIES / f"{one.method}-{one.seed}.safetensors"
        if path.exists():
            found.append(Scene(path=path, changed=0, learner=one))
    if found:  # the run is over: the first learner's will do
        return found[0]
    of = {(one.method, one.seed): one for one in status.learners}
    for shard in range(store.count_shards(run.folder)):
        path = store.shard_folder(run.folder, shard) / store.CURRENT
        members = store.shard_members(run.folder, run.plan, shard)
        begun = [m for m in members if (m.method.name, m.seed) in of] or members
        # Those by natural policy gradient go one after another: the policy is the last one's.
        shown = begun[-1] if run.plan.learner is None else begun[0]
        learner = of.get((shown.method.name, shown.seed))
        if learner is not None and path.exists():
            found.append(Scene(path=path, changed=path.stat().st_mtime_ns, learner=learner))
    return max(found, key=lambda scene: scene.changed, default=None)


def _frames(take: Rollout) -> Generator[np.ndarray, None, None]:
    """Frames of a rollout; one where the picture is a recorded one."""
    tick = (1.0 if take.held is None else _SLOWLY) / FPS
    for count in range(max(1, round(take.seconds / tick))):
        stage = shared_stage(take.evolve)  # an explorer may have used it since
        stage.resize(WIDTH, HEIGHT)
        stage.effects(False)
        yield stage.frame(take.alpha, take.qpos[take.row(count * tick)], places=take.places)
        if isinstance(stage, Recorded):
            return


def _words(take: Rollout, one: LearnerStatus, frames: int) -> str:
    """What a film shows, in words."""
    note = f" ({NOTE})" if frames == 1 else ""
    return (f"{take.evolve.name} at alpha {take.alpha:.2f}, moved by the policy of {one.method}, "
            f"seed {one.seed}: {achieved(take)} in {take.seconds:.1f} s{note}")  # fmt: skip


def _as_gif(frames: list[np.ndarray], alt: str) -> Picture:
    """A film in memory."""
    if len(frames) == 1:
        return picture(frames[0], alt)
    with tempfile.TemporaryDirectory() as folder:
        return picture(write_movie(frames, Path(folder) / "film.gif", FPS), alt)
