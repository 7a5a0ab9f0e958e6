"""All that a vector environment is at one moment, so that a run can go on from it bit for bit."""

from typing import Any

import numpy as np

from revolver_lab.envs.robot_vector import RobotVectorEnv

_ARRAYS = ("alphas", "halted", "_next_alphas", "_steps", "held", "_returns", "_waiting", "_last")


def take(env: RobotVectorEnv) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Returns the state of an environment: arrays by name, and plain values.

    Args:
        env: Between two steps.
    """
    arrays = {name.strip("_"): getattr(env, name).copy() for name in _ARRAYS}
    streams = [[rng.bit_generator.state for rng in some] for some in (env._starts, env._draws)]
    return arrays | {"physics": env.batch.state.copy()}, {"streams": streams}


def put_back(env: RobotVectorEnv, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
    """Returns an environment to the state that `take` returned.

    Args:
        env: Made with the same arguments as the one whose state it was.
        arrays: The arrays.
        plain: The plain values.
    """
    for i in np.flatnonzero(env.alphas != arrays["alphas"]):
        env.evolve.write_model(env.models[i], float(arrays["alphas"][i]))
    env.take_robots()
    for name in _ARRAYS:
        getattr(env, name)[:] = arrays[name.strip("_")]
    env.batch.state[:] = arrays["physics"]
    env.batch.forward()  # what tasks read is derived again; it moves the solver's warm start
    env.batch.state[:] = arrays["physics"]
    env.batch.warning[:] = 0
    for some, held in zip((env._starts, env._draws), plain["streams"], strict=True):
        for rng, state in zip(some, held, strict=True):
            rng.bit_generator.state = state
