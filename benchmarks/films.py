"""A 100-frame GIF against rendering its frames, in one run."""

import gc
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import revolver_lab as rvl
from revolver_lab.lab import encoders
from revolver_lab.lab.films import film_frames
from revolver_lab.lab.frames import Stage
from revolver_lab.lab.rollouts import Rollout

FRAMES, WIDTH, HEIGHT, FPS = 100, 320, 240, 20
ROUNDS = 3


def run() -> list[dict]:
    """Rows of the table of benchmarks; times are the best of three, taken in turn."""
    times = {"gif": [], "frames": []}
    rollout = _rollout()
    for _ in range(ROUNDS):
        times["frames"].append(_seconds(lambda: _render(rollout)))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.gif"
            times["gif"].append(_seconds(lambda: _film(rollout, path)))  # noqa: B023
            size = path.stat().st_size
    gif, frames = min(times["gif"]), min(times["frames"])
    return [
        {
            "work": "100-frame GIF, 320x240",
            "against": "rendering those frames",
            "ratio": gif / frames,
            "aim": "<= 1.5",
            "detail": f"{gif:.2f} s against {frames:.2f} s; {size / 1e6:.2f} MB",
        }
    ]


def _rollout() -> Rollout:
    """A cheetah that swings its legs while it goes along."""
    time_ = np.arange(FRAMES) / FPS
    qpos = 0.4 * np.sin(2 * np.pi * time_[:, None] + np.arange(9))
    qpos[:, 0], qpos[:, 1], qpos[:, 2] = 3 * time_, 0, 0
    evolve = rvl.load("cheetah-front-leg")
    return Rollout(
        evolve=evolve, alpha=0.5, qpos=qpos, rewards=np.ones(FRAMES), title="half way", dt=1 / FPS
    )


def _render(rollout: Rollout) -> None:
    """Only render: the same stage and poses, nothing kept."""
    with Stage(rollout.evolve, width=WIDTH, height=HEIGHT) as stage:
        for qpos in rollout.qpos:
            stage.frame(rollout.alpha, qpos)


def _film(rollout: Rollout, path: Path) -> None:
    """The whole film: stage, frames, captions, palette, compression, file."""
    frames = film_frames(rollout, width=WIDTH, height=HEIGHT, fps=FPS)
    encoders.write_movie(frames, path, FPS)


def _seconds(work: Callable[[], None]) -> float:
    gc.collect()
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == "__main__":
    for row in run():
        print(row)
