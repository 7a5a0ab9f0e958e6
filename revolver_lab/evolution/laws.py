"""Two actuators under one law, gain(q, v) a + bias(q, v), where a may follow the control slowly."""

from collections.abc import Sequence

import mujoco
import numpy as np

from revolver_lab.evolution.canonical import Element
from revolver_lab.evolution.keyframes import extend_keyframes

_GAINS = (mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtGain.mjGAIN_AFFINE)
_BIASES = (mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE)
_NONE, _EXACT = mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTEREXACT
# Those that have one activation each.
_DYNAMICS = (
    _EXACT,
    mujoco.mjtDyn.mjDYN_FILTER,
    mujoco.mjtDyn.mjDYN_INTEGRATOR,
    mujoco.mjtDyn.mjDYN_MUSCLE,
)
_AT_ONCE = 1e-10
"""A time constant [s] that is nothing beside any timestep: 1 - exp(-dt / tau) is 1, to the bit."""


def align_activations(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    motors: Sequence[tuple[Element, Element]],
    *,
    switching: bool,
) -> None:
    """Give an actuator without dynamics, opposite one with them, an activation that is its control.

    It follows the control exactly, at once and early, so nothing else of the robot changes, and
    both robots have as many activations.

    Args:
        source: A canonical robot, changed in place.
        target: The other one, changed in place.
        motors: The paired actuators.
        switching: Whether dynamics that differ may switch along the path; otherwise only those
            that differ by no more than their time constant are brought to one form.
    """

    def opposite(other: Element) -> bool:
        early = other.dyntype == _EXACT and other.actearly
        return early or (switching and other.dyntype in _DYNAMICS)

    lacking = [], []
    for pair in motors:
        for side, other, found in zip(pair, pair[::-1], lacking):
            if side.dyntype == _NONE and opposite(other):
                found.append((side, other))
    for spec, found in zip((source, target), lacking):
        if not found:
            continue
        before = spec.compile()
        for side, other in found:
            side.dyntype, side.actearly = _EXACT, True
            side.dynprm = [_AT_ONCE, *other.dynprm[1:]]
            side.actrange = other.actrange  # which nothing is limited to
        extend_keyframes(spec, before)


def align_muscles(a: Element, b: Element, models: tuple[mujoco.MjModel, mujoco.MjModel]) -> None:
    """Let both actuators state what only one states: its range of lengths, its peak force."""
    if np.any(a.lengthrange) != np.any(b.lengthrange):
        for actuator, model in zip((a, b), models):
            actuator.lengthrange = model.actuator_lengthrange[actuator.id]
    muscles = a.gaintype == b.gaintype == mujoco.mjtGain.mjGAIN_MUSCLE
    if not muscles or (a.gainprm[2] < 0.0) == (b.gainprm[2] < 0.0):
        return
    for actuator, model in zip((a, b), models):
        for attribute in ("gainprm", "biasprm"):
            values = np.array(getattr(actuator, attribute))
            if values[2] < 0.0:  # it is then found from a scale, and from what the muscle moves
                values[2] = values[3] / max(model.actuator_acc0[actuator.id], mujoco.mjMINVAL)
                setattr(actuator, attribute, values)


def align_laws(a: Element, b: Element) -> None:
    """Let a motor and a servo have one law, gain(q, v) u + bias(q, v), with what is absent 0."""
    if not all(each.gaintype in _GAINS and each.biastype in _BIASES for each in (a, b)):
        return
    if a.biastype != b.biastype:
        for each in (a, b):
            if each.biastype == mujoco.mjtBias.mjBIAS_NONE:  # its parameters are not looked at
                each.biastype, each.biasprm = mujoco.mjtBias.mjBIAS_AFFINE, 0 * each.biasprm
    if a.gaintype != b.gaintype:
        for each in (a, b):
            if each.gaintype == mujoco.mjtGain.mjGAIN_FIXED:  # of its parameters, only the first
                each.gaintype = mujoco.mjtGain.mjGAIN_AFFINE
                each.gainprm = [each.gainprm[0], *[0.0] * (len(each.gainprm) - 1)]
    if a.ctrlspec != b.ctrlspec:  # says what the control is called; these have one control
        a.ctrlspec = b.ctrlspec = 0
