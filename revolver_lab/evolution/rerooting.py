"""Roots a floating robot at another of its bodies, so that it moves as before."""

import mujoco


def reroot(spec: mujoco.MjSpec, body_name: str) -> mujoco.MjSpec:
    """To come."""
    raise NotImplementedError(body_name)
