"""E(alpha) against bare compiles of the same robots."""

import itertools
import statistics

import numpy as np
from dm_control.mujoco import Physics, wrapper

import revolver_lab as rvl
from benchmarks.timing import paired, row, seconds
from revolver_lab import _gl
from revolver_lab.robots import registry

ANT = "ant-length-mass"


def _alphas() -> itertools.count:
    return itertools.count(1)


def run() -> list[dict[str, object]]:
    """A fresh Physics, a moved one, and 1,001 Ants."""
    _gl.choose()
    return [_fresh(), _moved(), _many()]


def _fresh() -> dict[str, object]:
    evolve, spec, steps = rvl.load(ANT), registry.get(ANT).source(), _alphas()
    evolve.model(0)
    timing = paired(
        lambda: evolve(next(steps) / 1000),
        lambda: Physics.from_model(wrapper.MjModel(spec.compile())),
        100,
    )
    detail = f"{1e3 * timing['ours_s']:.2f} ms against {1e3 * timing['peer_s']:.2f} ms"
    return row(
        "evolve(alpha), fresh Physics, Ant",
        "MjSpec.compile + Physics.from_model",
        "<= 1.5",
        timing["ratio"],
        detail,
    )


def _moved() -> dict[str, object]:
    evolve = rvl.load(ANT)
    physics = evolve(0)
    alphas = [i / 100 for i in range(101)]
    for alpha in alphas:
        evolve.set_alpha(physics, alpha)
    rng = np.random.default_rng(0)
    times = [
        1e3 * seconds(lambda a=alpha: evolve.set_alpha(physics, a))
        for alpha in rng.choice(alphas, 1000).tolist()
    ]
    worst = np.percentile(times, 99)
    return row(
        "set_alpha from cache, Ant",
        "1 ms",
        "<= 1 ms",
        statistics.median(times),
        f"median {statistics.median(times):.3f} ms, 99 % below {worst:.3f} ms, mj_forward included",
    )


def _many() -> dict[str, object]:
    spec = registry.get(ANT).source()
    evolve = rvl.load(ANT)
    evolve.model(0)
    # In turn, in blocks of 77 = 1001 / 13, so that both meet the same machine.
    blocks = np.linspace(0, 1, 1001).reshape(13, 77)
    pairs = [
        (
            seconds(lambda b=block: [evolve.model(a) for a in b]),
            seconds(lambda: [spec.compile() for _ in range(77)]),
        )
        for block in blocks
    ]
    ours, peer = (sum(column) for column in zip(*pairs))
    return row(
        "1,001 Ants",
        "1,001 bare compiles",
        "<= 1.3",
        ours / peer,
        f"{ours:.2f} s against {peer:.2f} s; cache {evolve.cache_nbytes / 2**20:.1f} MiB for 1,001",
    )
