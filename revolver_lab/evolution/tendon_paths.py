"""Places on tendons, whose coefficients MjSpec can read but not write."""

from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass
class Place:
    """One place on a tendon's path, with the numbers to compile it with.

    Attributes:
        tendon: Name of the tendon.
        index: Position on its path.
        type: mjtWrap: joint, pulley, site, sphere or cylinder.
        coef: Factor of a joint's coordinate (fixed tendons).
        divisor: Divisor of a pulley (spatial tendons).
    """

    tendon: str
    index: int
    type: mujoco.mjtWrap
    coef: float
    divisor: float

    def number(self) -> float | None:
        """What the compiled model holds for this place, where it is a number."""
        if self.type == mujoco.mjtWrap.mjWRAP_JOINT:
            return self.coef
        return self.divisor if self.type == mujoco.mjtWrap.mjWRAP_PULLEY else None


def places(spec: mujoco.MjSpec) -> dict[str, Place]:
    """Every place on every tendon, as "tendon.index"."""
    return {
        f"{tendon.name}.{i}": Place(
            tendon.name, i, wrap.type, _number(wrap.coef), _number(wrap.divisor)
        )
        for tendon in spec.tendons
        for i, wrap in enumerate(tendon.path)
    }


def _number(value: float | None) -> float:
    """What is not given, as not-a-number: the mark that MjSpec uses elsewhere."""
    return np.nan if value is None else value


def compiled(spec: mujoco.MjSpec, wanted: dict[str, Place]) -> mujoco.MjModel:
    """The robot, compiled with the coefficients that are wanted.

    Where they differ from the spec's they are set in the compiled model, and what MuJoCo derives
    from them (rest lengths, inverse weights) is derived again.

    Args:
        spec: A robot.
        wanted: What `places` gave, with the numbers to use.

    Raises:
        ValueError: As MjSpec.compile does.
    """
    model = spec.compile()
    if not _set(model, wanted):
        return model
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos_spring
    mujoco.mj_fwdPosition(model, data)
    for i, tendon in enumerate(spec.tendons):
        if tendon.springlength[0] == _REST == tendon.springlength[1]:
            model.tendon_lengthspring[i] = data.ten_length[i]
    mujoco.mj_setConst(model, data)
    return model


# MJCF's springlength for "the length at the spring's reference pose".
_REST = -1.0


def _set(model: mujoco.MjModel, wanted: dict[str, Place]) -> bool:
    """Set the coefficients, and say whether any of them moved."""
    before = model.wrap_prm.copy()
    for place in wanted.values():
        number = place.number()
        if number is not None:
            model.wrap_prm[model.tendon_adr[model.tendon(place.tendon).id] + place.index] = number
    return not np.array_equal(before, model.wrap_prm)
