"""Hangs links that are welded to each other from one of them, as files chain them in any order."""

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.canonical import canonical
from revolver_lab.evolution.matching import Matching, match
from revolver_lab.evolution.rebuilding import add_whole_body, of_subtrees, rebuilt
from revolver_lab.evolution.rerooted_state import unit


def correspond(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    *,
    pins: Mapping[str, str] | None,
    root: str | None,
    switching: bool,
) -> tuple[mujoco.MjSpec, mujoco.MjSpec, Matching]:
    """Find what corresponds in two robots as they are written, or with chains of welds undone.

    One quadruped's legs hang from its trunk, another's from a trunk that is welded to an empty
    base. Body by body from the roots down, a trunk would become a base and a hip a trunk. Chains
    are undone only where fewer bodies, joints and actuators have to be created then.

    Args:
        source: A robot from `read_robot`.
        target: Another.
        pins: See `match`, as for what follows.
        root: Body of the target to take as its root.
        switching: Whether what is discrete may differ.

    Returns:
        Source, target, and what corresponds in these.

    Raises:
        MatchingError: If the two cannot be put in correspondence.
    """
    given = source, target
    unchained = [unchain(spec) if is_chained(spec) else spec for spec in given]
    if all(spec is before for spec, before in zip(unchained, given)):
        return *given, match(*given, pins=pins, root=root, switching=switching)
    found: list[tuple[mujoco.MjSpec, mujoco.MjSpec, Matching]] = []
    refusals: list[MatchingError] = []
    for a, b in (given, unchained):
        try:
            made = match(a, b, pins=pins, root=root, switching=switching)
            found.append((a, b, replace(made, unchained=(a, b) != given)))
        except MatchingError as refusal:
            refusals.append(refusal)
    if not found:
        raise refusals[0]
    return min(found, key=lambda one: one[2].created)


def is_chained(spec: mujoco.MjSpec) -> bool:
    """Whether a link is welded to one that is welded itself, and may be hung from another.

    A sensor of a subtree means what hangs below its body, so a robot with one stays as it is.
    """
    if any(of_subtrees(sensor) for sensor in spec.sensors):
        return False
    return any(_is_welded(body) and _is_welded(body.parent) for body in spec.bodies)


def _is_welded(body: mujoco.MjsBody | None) -> bool:
    """Whether a body cannot move against its parent."""
    return body is not None and body.name != "world" and not body.joints and not body.mocap


def unchain(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The same robot, in which no link is welded to a welded one.

    What is welded to each other moves as one whichever link carries which, and touches as before:
    MuJoCo goes by groups of welded bodies there. Where the links come in another order then, so do
    the two geoms of a contact, and the pyramid of friction may stand otherwise.

    Args:
        spec: A robot in which everything has a name; it is left as it was.

    Returns:
        The robot in canonical form, with the same names and keyframes.
    """
    return rebuilt(canonical(spec), lambda here, body: _hang(here, body, body.pos, body.quat))


def _hang(here: mujoco.MjsBody, body: mujoco.MjsBody, pos: np.ndarray, quat: np.ndarray) -> None:
    """Hang a body with all below it; what is welded to a welded one hangs beside it."""
    copy = add_whole_body(here, body)
    copy.pos, copy.quat = pos, quat
    for child in body.bodies:
        if _is_welded(body) and _is_welded(child):
            there = np.empty(3), np.empty(4)
            mujoco.mju_mulPose(*there, pos, unit(quat), child.pos, unit(child.quat))
            _hang(here, child, *there)
        else:
            _hang(copy, child, child.pos, child.quat)
