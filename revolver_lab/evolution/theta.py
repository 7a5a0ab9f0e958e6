"""theta(alpha) = (1 - f(alpha)) theta_S + f(alpha) theta_T, and how it is written into a robot."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from revolver_lab.evolution import rotations
from revolver_lab.evolution.parameters import (
    DIRECTION,
    LINEAR,
    ROTATION,
    Parameter,
)
from revolver_lab.evolution.ramps import Ramps, release

_HOLDING = ("armature", "stiffness", "damping")
"""What `shrinking.hold_joint` holds a joint by."""


@dataclass(frozen=True, kw_only=True)
class Switch:
    """A discrete attribute that differs, and the alpha at which it becomes the target's.

    Attributes:
        element: Source element, as (kind, name).
        attribute: Its name in MjSpec.
        source: Value below alpha.
        target: Value from alpha on.
        alpha: Where it switches, in (0, 1].
    """

    element: tuple[str, str]
    attribute: str
    source: Any
    target: Any
    alpha: float

    @property
    def path(self) -> str:
        """What to call it: "geom/foot/type"."""
        return "/".join((*self.element, self.attribute))


@dataclass(frozen=True, kw_only=True)
class Block:
    """One attribute of one pair of elements: a slice of theta.

    Attributes:
        element: Source element, as (kind, name).
        parameter: Which attribute, its unit and how it moves.
        source: Value at alpha = 0, flat.
        target: Value at alpha = 1, flat.
        names: One per coordinate in theta, with units.
    """

    element: tuple[str, str]
    parameter: Parameter
    source: np.ndarray
    target: np.ndarray
    names: tuple[str, ...]

    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """theta_S and theta_T of this block: numbers, or rotation vectors from the source."""
        if self.parameter.how == LINEAR:
            return self.source, self.target
        between = rotations.between_frames
        if self.parameter.how == DIRECTION:
            between = rotations.between_axes
        if self.same():
            return np.zeros(3), np.zeros(3)
        return np.zeros(3), between(self.source, self.target)

    def same(self) -> bool:
        """Whether source and target agree to the last bit."""
        return np.array_equal(self.source, self.target, equal_nan=True)

    def value(self, theta: np.ndarray, f: np.ndarray) -> np.ndarray:
        """The attribute for this block's part of theta and of f; exact where f is 0 or 1."""
        if self.parameter.how == LINEAR:
            # What is not finite means "not given" in MJCF, and is equal on both sides.
            return np.where(np.isfinite(self.source), theta, self.source)
        if f[0] == 0.0:
            return self.source
        if f[0] == 1.0:
            return self.target
        if self.parameter.how == ROTATION:
            return rotations.turned_frame(self.source, theta)
        return rotations.turned_axis(self.source, theta)


@dataclass(frozen=True)
class Theta:
    """Every continuous parameter of a matched pair of robots, and the discrete ones that switch.

    Attributes:
        blocks: One per attribute of each pair of elements.
        switches: What has no in-between.
        ramps: f of every parameter.
        held: Joints that one robot holds still, and the alpha at which it does, 0 or 1: what
            holds them lets go, or takes hold, by `ramps.release` of f.
        names: Names of the D coordinates of theta, with units.
        source: theta_S, (D,).
        target: theta_T, (D,).
        changed: Which coordinates differ, (D,) bool.
    """

    blocks: tuple[Block, ...]
    switches: tuple[Switch, ...]
    ramps: Ramps
    held: Mapping[str, int] = field(default_factory=dict)
    names: tuple[str, ...] = field(init=False)
    source: np.ndarray = field(init=False)
    target: np.ndarray = field(init=False)
    changed: np.ndarray = field(init=False)
    _groups: np.ndarray = field(init=False, repr=False)
    _released: dict[int, np.ndarray] = field(init=False, repr=False)
    _moving: list[tuple[Block, slice]] = field(init=False, repr=False)

    def __post_init__(self):
        ends = [block.ends() for block in self.blocks]
        put = object.__setattr__
        put(self, "names", tuple(name for block in self.blocks for name in block.names))
        put(self, "source", np.concatenate([np.zeros(0), *(s for s, _ in ends)]))
        put(self, "target", np.concatenate([np.zeros(0), *(t for _, t in ends)]))
        put(self, "changed", ~_equal(self.source, self.target))
        put(self, "_groups", self.ramps.groups(list(self.names)))
        stops = np.cumsum([len(block.names) for block in self.blocks])
        put(self, "_moving", self._moving_blocks(stops))
        put(self, "_released", {end: self._holding(end) for end in (0, 1)})

    def _moving_blocks(self, stops: np.ndarray) -> list[tuple[Block, slice]]:
        """The blocks that change along the path: the only ones to write again."""
        return [
            (block, slice(stop - len(block.names), stop))
            for block, stop in zip(self.blocks, stops.tolist())
            if not block.same()
        ]

    @property
    def attributes(self) -> set[str]:
        """MuJoCo's names of the attributes that change for any element."""
        return {block.parameter.attribute for block, _ in self._moving}

    def __call__(self, alpha: float) -> np.ndarray:
        """theta(alpha), (D,); exact at both ends (section 4.1, equation 2)."""
        return self._at(self._f(alpha))

    def _holding(self, end: int) -> np.ndarray:
        """Which coordinates hold a joint still at one end of the path, (D,) bool."""
        return np.array([
            kind == "joint" and self.held.get(name) == end and block.parameter.attribute in _HOLDING
            for block in self.blocks for kind, name in [block.element] for _ in block.names
        ], dtype=bool)  # fmt: skip

    def _f(self, alpha: float) -> np.ndarray:
        f = self.ramps(alpha)[self._groups]
        if self.held:
            going, coming = self._released[0], self._released[1]
            f[going] = [release(x) for x in f[going]]
            f[coming] = [1.0 - release(1.0 - x) for x in f[coming]]
        return f

    def _at(self, f: np.ndarray) -> np.ndarray:
        theta = (1.0 - f) * self.source + f * self.target
        return np.where(self.changed, theta, self.source)

    def write(self, alpha: float, spec: mujoco.MjSpec, found: Mapping[str, dict]) -> None:
        """Write theta(alpha) into the spec that it was read from.

        Args:
            alpha: Evolution parameter in [0, 1].
            spec: The padded source robot; only attributes that change are touched.
            found: Its elements, as kind -> name -> element.
        """
        f = self._f(alpha)
        theta = self._at(f)
        for block, where in self._moving:
            kind, name = block.element
            element, attribute = found[kind][name], block.parameter.attribute
            value = block.value(theta[where], f[where])
            if not hasattr(getattr(element, attribute), "__len__"):  # MjSpec takes no array here
                value = float(value[0])
            setattr(element, attribute, value)
        for switch in self.switches:
            kind, name = switch.element
            value = switch.target if alpha >= switch.alpha else switch.source
            setattr(found[kind][name], switch.attribute, value)


def _equal(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a == b) | (np.isnan(a) & np.isnan(b))
