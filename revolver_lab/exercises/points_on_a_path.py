"""Checks of notebook 01: where zeros go, what theta holds, and what f must do."""

from typing import Any

import numpy as np

from revolver_lab.exercises.verdict import NotYet, Verdict, call, judge, numbers

JOINTS = ("knuckle", "tip", "base", "little")
"""Joints of E(0) in the order of qpos; "tip" and "little" were created."""
KEPT = (0, 2)
"""Places of the gripper's own two joints among them."""
RADII = (0.03, 0.05)
DENSITY = 1000.0
"""The pad: radius in the source and in the target [m], density in both [kg/m^3]."""
TURN = np.deg2rad(-60.0)
"""The thumb's turn about y from source to target [rad]."""

_POSE = (0.3, -0.2)
_NEAR = 1e-6
_CORNER = 0.5
"""How much a slope may change within a thousandth of the path, which is 20 times smoothstep's."""
_ALPHAS = (0.0, 0.25, 0.5, 0.75, 1.0)


def one(answer: Any) -> Verdict:
    """Exercise 1: a pose of the gripper, (2,), as a pose of E(0), (4,).

    Args:
        answer: Function of the gripper's qpos that returns that of E(0).
    """
    return judge(
        answer,
        _insertion_mistake,
        "The gripper's numbers stay with the gripper's joints, and what was created rests at zero: "
        "a policy of the gripper sees what it always saw.",
    )


def _insertion_mistake(answer: Any) -> None:
    """Zero insertion at the wrong place, of something else, or not at all."""
    found = np.ravel(np.asarray(call(answer, list(_POSE)), dtype=object))
    if len(found) == len(_POSE):
        raise NotYet("Nothing was inserted: E(0) has four joints, for the created ones count too.")
    pose = numbers(found, len(JOINTS), "The pose of E(0)")
    if np.allclose(pose, [*_POSE, 0, 0]):
        raise NotYet(
            "The zeros are at the end, as if created joints came last. MuJoCo numbers joints down "
            "the tree, limb by limb: `tip` hangs below `knuckle` and is numbered right after it."
        )
    for name, value in zip(("knuckle", "base"), _POSE, strict=True):
        there = [JOINTS[i] for i in np.flatnonzero(np.isclose(pose, value))]
        if not there:
            raise NotYet(f"The angle of `{name}`, {value}, is lost: insert zeros, change nothing.")
        if name not in there:
            raise NotYet(f"The angle of `{name}` arrived at `{there[0]}`. The order is {JOINTS}.")
    created = np.delete(pose, KEPT)
    if created.any():
        raise NotYet(
            f"The created joints are at {created.tolist()}. They copy nothing and mirror nothing: "
            "what was created rests at zero, or the gripper would no longer move as it did."
        )


def two(answer: Any) -> Verdict:
    """Exercise 2: mass of the pad [kg] and quaternion (w, x, y, z) of the thumb in E(alpha).

    Args:
        answer: Function of alpha that returns both; f is linear.
    """
    return judge(
        answer,
        _between_mistake,
        "theta holds the radius and the turn; the mass and the quaternion follow from them, and "
        "neither lies on a straight line.",
    )


def _between_mistake(answer: Any) -> None:
    """Mistakes in either number, over alphas."""
    pairs = [call(answer, alpha) for alpha in _ALPHAS]
    if any(not isinstance(pair, tuple | list) or len(pair) != 2 for pair in pairs):
        raise NotYet("Return two things: the mass, and the quaternion as four numbers.")
    masses = [numbers(mass, None, "The mass") for mass, _ in pairs]
    _mass_mistake(np.array(masses))
    _turn_mistake(np.array([numbers(turn, 4, "The quaternion") for _, turn in pairs]))


def _ball(radius: np.ndarray | float) -> np.ndarray:
    """Mass of a ball of the pad's density, 4/3 pi r^3 rho [kg]."""
    return DENSITY * 4 / 3 * np.pi * np.asarray(radius) ** 3


def _mass_mistake(masses: np.ndarray) -> None:
    """Masses at `_ALPHAS` that are not those of a ball whose radius is interpolated."""
    alphas, (small, large) = np.array(_ALPHAS), RADII
    radii = (1 - alphas) * small + alphas * large
    right, straight = _ball(radii), (1 - alphas) * _ball(small) + alphas * _ball(large)
    known = [
        (straight, "You interpolated the mass, or the solid itself: it is right at both ends and "
         "nowhere between. theta holds the radius; interpolate that, and let the mass follow."),
        (right[::-1], "The pad is heaviest at alpha = 0, so the ends are swapped."),
        (right / DENSITY, "That is the volume. Mass is density times volume."),
        (8 * right, "Eight times too heavy: you doubled the radius. MuJoCo's `size` of a sphere is "
         "its radius already, and so is r in 4/3 pi r^3."),
        (right / 8, "Eight times too light: you halved the radius. MuJoCo's `size` of a sphere is "
         "its radius, not its diameter."),
    ]  # fmt: skip
    _compare(masses, right, known)
    if not np.allclose(masses, right, rtol=1e-3, atol=0):
        raise NotYet(
            f"At alpha = 0.5 the pad weighs {masses[2]:.4g} kg in your answer. Its radius there is "
            "the mean of the two; a ball has the volume 4/3 pi r^3."
        )


def _turn_mistake(turns: np.ndarray) -> None:
    """Quaternions at `_ALPHAS` that are not slerp from the identity to the thumb's turn."""
    alphas = np.array(_ALPHAS)
    right = _about_y(alphas * TURN)
    lerp = (1 - alphas[:, None]) * right[0] + alphas[:, None] * right[-1]
    known = [
        (lerp, "That is lerp: four numbers mixed one by one no longer have length 1, so they are "
         "no rotation. theta holds the angle; interpolate that."),
        (lerp / np.linalg.norm(lerp, axis=1, keepdims=True), "A normalised lerp is a rotation, but "
         "not the one asked for: it turns slowly at the ends and fast in the middle. slerp turns "
         "evenly."),
        (np.roll(right, -1, axis=1), "The order is (x, y, z, w); MuJoCo writes (w, x, y, z)."),
        (_about_y(-alphas * TURN), "The thumb turns the wrong way: its angle is -60 degrees."),
        (_about_y(2 * alphas * TURN), "It turns twice as far: a quaternion holds cos and sin of "
         "half the angle."),
        (_about_y(np.rad2deg(alphas * TURN)), "cos and sin took degrees for radians."),
        (right[::-1], "The thumb is turned at alpha = 0, so the ends are swapped."),
    ]  # fmt: skip
    turns, known = _signed(turns), [(_signed(wrong), message) for wrong, message in known]
    _compare(turns, _signed(right), known)
    if not np.allclose(turns, _signed(right), atol=_NEAR):
        raise NotYet(
            f"At alpha = 0.5 your thumb has the quaternion {np.round(turns[2], 4).tolist()}. It "
            "turns about y by the share f(alpha) of -60 degrees: (cos, 0, sin, 0) of half of it."
        )


def _signed(turns: np.ndarray) -> np.ndarray:
    """Quaternions, (n, 4), of which w or else y is positive: q and -q are one turn."""
    leading = np.where(np.abs(turns[:, 0]) > _NEAR, turns[:, 0], turns[:, 2])
    return turns * np.where(leading < 0, -1, 1)[:, None]


def _about_y(angles: np.ndarray) -> np.ndarray:
    """Quaternions (w, x, y, z) of turns about y, (n, 4)."""
    zero = np.zeros_like(angles)
    return np.stack([np.cos(angles / 2), zero, np.sin(angles / 2), zero], axis=1)


def _compare(found: np.ndarray, right: np.ndarray, known: list[tuple[np.ndarray, str]]) -> None:
    """Raise the message of the known mistake that was found, unless the answer is right."""
    if np.allclose(found, right, rtol=_NEAR, atol=_NEAR * np.abs(right).max()):
        return
    for wrong, message in known:
        if np.allclose(found, wrong, rtol=1e-4, atol=_NEAR * np.abs(wrong).max()):
            raise NotYet(message)


def three(answer: Any) -> Verdict:
    """Exercise 3: an f that rests until alpha = 1/2 and then rises to 1 without a corner.

    Args:
        answer: Function of alpha.
    """
    return judge(
        answer,
        _path_mistake,
        "f(0) = 0, f(1) = 1, no jump and no corner: with this f the robot waits for half of the "
        "path, and then begins to change slowly.",
    )


def _path_mistake(answer: Any) -> None:
    """What makes a function no f at all, then what makes it another f than asked for."""
    alphas = np.linspace(0, 1, 1001)
    f = np.array([numbers(call(answer, float(alpha)), None, "f(alpha)") for alpha in alphas])
    if abs(f[-1] - 1) > _NEAR:
        raise NotYet(
            f"f(1) = {f[-1]:.4g}, but f(1) = 1 is needed, or the path ends before the target. "
            "A ramp that starts late has to rise faster: stretch [1/2, 1] over [0, 1] first."
        )
    if abs(f[0]) > _NEAR:
        raise NotYet(f"f(0) = {f[0]:.4g}, but f(0) = 0 is needed: E(0) has to be the source.")
    if f.min() < -_NEAR or f.max() > 1 + _NEAR:
        raise NotYet(
            f"f leaves [0, 1]: it reaches {f.min() if f.min() < -_NEAR else f.max():.3g}. Outside, "
            "theta is beyond source or target, where sizes may turn negative. Clip."
        )
    _shape_mistake(f)


def _shape_mistake(f: np.ndarray) -> None:
    """Mistakes of an f that starts at 0 and ends at 1, from its values on a fine grid."""
    middle, slopes = len(f) // 2, np.diff(f) * (len(f) - 1)
    if np.abs(np.diff(f)).max() > 0.1:
        raise NotYet(
            "f jumps: no robots lie between those on either side. E must be continuous, for a "
            "policy is carried along it in small steps."
        )
    if np.abs(f[: middle + 1]).max() > _NEAR:
        raise NotYet(
            f"f(0.25) = {f[middle // 2]:.3g}: the robot changes from the start. Let f rest at 0 "
            "until alpha = 1/2."
        )
    if slopes.min() < -_NEAR:
        raise NotYet("f goes back on its way: robots would appear twice. Let it only rise.")
    sharpest = int(np.abs(np.diff(slopes)).argmax())
    before, after = slopes[sharpest : sharpest + 2]
    if abs(after - before) > _CORNER:
        raise NotYet(
            f"f has a corner at alpha = {(sharpest + 1) / (len(f) - 1):.3g}: its slope there is "
            f"{before:.2g}, and then {after:.2g}. smoothstep, x^2 (3 - 2x), is flat at both ends."
        )
    if f[3 * len(f) // 4] < _NEAR:
        raise NotYet(
            "f(0.75) = 0: the robot still rests. Let f rest until alpha = 1/2, and then rise."
        )
