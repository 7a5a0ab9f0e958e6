"""theta(alpha) = (1 - f(alpha)) theta_S + f(alpha) theta_T, and how it is written into a robot."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.evolution import rotations
from revolver_lab.evolution.canonical import Pairs, elements, has_fromto
from revolver_lab.evolution.parameters import (
    CONTINUOUS,
    DIRECTION,
    DISCRETE,
    LINEAR,
    ROTATION,
    Parameter,
)
from revolver_lab.evolution.ramps import Ramps, RampSpec

_QUANTITY = {mujoco.mjtJoint.mjJNT_SLIDE: "m"}


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
        switches: (kind, name, attribute, source value, target value, alpha) of what switches.
        ramps: f of every parameter.
    """

    blocks: tuple[Block, ...]
    switches: tuple[tuple[str, str, str, object, object, float], ...]
    ramps: Ramps
    names: tuple[str, ...] = field(init=False)
    source: np.ndarray = field(init=False)
    target: np.ndarray = field(init=False)

    def __post_init__(self):
        ends = [block.ends() for block in self.blocks]
        put = object.__setattr__
        put(self, "names", tuple(name for block in self.blocks for name in block.names))
        put(self, "source", np.concatenate([np.zeros(0), *(s for s, _ in ends)]))
        put(self, "target", np.concatenate([np.zeros(0), *(t for _, t in ends)]))
        put(self, "_same", _equal(self.source, self.target))
        put(self, "_groups", self.ramps.groups([name.split(" [")[0] for name in self.names]))
        stops = np.cumsum([len(block.names) for block in self.blocks])
        put(self, "_moving", self._moving_blocks(stops))

    def _moving_blocks(self, stops: np.ndarray) -> list[tuple[Block, slice]]:
        """The blocks that change along the path: the only ones to write again."""
        return [
            (block, slice(stop - len(block.names), stop))
            for block, stop in zip(self.blocks, stops.tolist())
            if not block.same()
        ]

    def __call__(self, alpha: float) -> np.ndarray:
        """theta(alpha), (D,); exact at both ends (section 4.1, equation 2)."""
        return self._at(self._f(alpha))

    def _f(self, alpha: float) -> np.ndarray:
        return self.ramps(alpha)[self._groups]  # type: ignore[attr-defined]

    def _at(self, f: np.ndarray) -> np.ndarray:
        theta = (1.0 - f) * self.source + f * self.target
        return np.where(self._same, self.source, theta)  # type: ignore[attr-defined]

    def changed(self) -> np.ndarray:
        """Which coordinates differ between source and target, (D,) bool."""
        return ~self._same  # type: ignore[attr-defined]

    def write(self, alpha: float, spec: mujoco.MjSpec, found: Mapping[str, dict]) -> None:
        """Write theta(alpha) into the spec that it was read from.

        Args:
            alpha: Evolution parameter in [0, 1].
            spec: The padded source robot; only attributes that change are touched.
            found: Its elements, as kind -> name -> element.
        """
        f = self._f(alpha)
        theta = self._at(f)
        for block, where in self._moving:  # type: ignore[attr-defined]
            kind, name = block.element
            value = block.value(theta[where], f[where])
            setattr(found[kind][name], block.parameter.attribute, _as_written(value))
        for kind, name, attribute, old, new, at in self.switches:
            setattr(found[kind][name], attribute, new if alpha >= at else old)


def _as_written(value: np.ndarray) -> float | np.ndarray:
    """Scalars as floats: MjSpec takes no arrays of one for them."""
    return float(value[0]) if value.shape == (1,) else value


def _equal(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a == b) | (np.isnan(a) & np.isnan(b))


def read_theta(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    pairs: Pairs,
    *,
    f: RampSpec,
    switch: float | Mapping[str, float] | None,
) -> Theta:
    """Read theta_S and theta_T off two padded, aligned robots.

    Args:
        source: The source robot, canonical.
        target: The target robot, canonical.
        pairs: For each kind of element, (name in source, name in target).
        f: The interpolation function, or patterns over the names of theta.
        switch: alpha at which discrete differences switch: one for all, or by name.

    Raises:
        ParameterError: If discrete attributes differ and no alpha is named for them, or a
            continuous one has no in-between.
    """
    blocks: list[Block] = []
    differences: list[tuple[str, str, str, object, object]] = []
    for kind, parameters in CONTINUOUS.items():
        ours, theirs = elements(source, kind), elements(target, kind)
        for a, b in pairs.get(kind, []):
            if (kind, a) == ("body", "world"):
                continue
            for parameter in parameters:
                blocks.extend(_block(kind, ours[a], theirs[b], a, parameter))
            for attribute in DISCRETE.get(kind, ()):
                old, new = getattr(ours[a], attribute), getattr(theirs[b], attribute)
                if old != new:
                    differences.append((kind, a, attribute, old, new))
    return Theta(tuple(blocks), _switched(differences, switch), Ramps(f))


def _flat(element: object, attribute: str) -> np.ndarray:
    return np.array(getattr(element, attribute), dtype=float).reshape(-1)


_STATED = ("mass", "ipos", "iquat", "inertia")


def _given(kind: str, element: object, attribute: str) -> bool:
    """Whether an attribute is given, and not inferred from another one."""
    if not hasattr(element, attribute):
        return False
    if kind == "body" and attribute in _STATED:
        return bool(element.explicitinertial)  # type: ignore[attr-defined]
    if kind in ("geom", "site") and attribute in ("pos", "quat"):
        return not has_fromto(element)
    if kind == "geom" and attribute == "density":
        return not np.isfinite(element.mass)  # type: ignore[attr-defined]
    # "Not given" is not-a-number in the first place: for fromto, MuJoCo marks no other.
    value = _flat(element, attribute)
    return bool(len(value)) and bool(np.isfinite(value[0]))


def _block(kind: str, ours: object, theirs: object, name: str, parameter: Parameter) -> list[Block]:
    """The block of one attribute, or none where neither robot gives it."""
    path = f"{kind}/{name}/{parameter.attribute}"
    given = [_given(kind, element, parameter.attribute) for element in (ours, theirs)]
    if not any(given):
        return []
    source, target = _flat(ours, parameter.attribute), _flat(theirs, parameter.attribute)
    if not all(given) or source.shape != target.shape:
        raise ParameterError(
            f"{path} given as {source.tolist()} in one robot and as {target.tolist()} in the other",
            "as many numbers in both",
            "Write this attribute in both files.",
        )
    _check_between(path, parameter, source, target)
    unit = _unit(kind, ours, parameter)
    size = len(source) if parameter.how == LINEAR else 3
    labels = [path] if size == 1 else [f"{path}[{i}]" for i in range(size)]
    names = tuple(f"{label} [{unit}]" if unit else label for label in labels)
    return [
        Block(
            element=(kind, name), parameter=parameter, source=source, target=target, names=names
        )
    ]


def _unit(kind: str, element: object, parameter: Parameter) -> str:
    """The unit of a parameter; a joint's depends on whether it turns or slides."""
    if kind != "joint":
        return parameter.unit
    return parameter.unit.format(q=_QUANTITY.get(element.type, "rad"))  # type: ignore[attr-defined]


def _check_between(path: str, parameter: Parameter, a: np.ndarray, b: np.ndarray) -> None:
    """Refuse two values between which there is nothing."""
    if parameter.attribute.startswith("solref") and np.any(a * b < 0):
        raise ParameterError(
            f"{path} = {a.tolist()} in one robot and {b.tolist()} in the other",
            "both positive (time constant, damping ratio) or both negative (stiffness, damping)",
            "Write both in the same of MuJoCo's two forms.",
        )


def _switched(
    differences: list[tuple[str, str, str, object, object]],
    switch: float | Mapping[str, float] | None,
) -> tuple[tuple[str, str, str, object, object, float], ...]:
    """Give every discrete difference its alpha, or refuse those that have none."""
    table = switch if isinstance(switch, Mapping) else {}
    for name, at in {**table, "switch": 1.0 if isinstance(switch, Mapping) else switch}.items():
        if at is not None and not 0.0 < float(at) <= 1.0:
            raise ParameterError(
                f"switch at alpha = {at} for {name!r}", "0 < alpha <= 1", "Name another alpha."
            )
    done, refused = [], []
    for kind, name, attribute, old, new in differences:
        path = f"{kind}/{name}/{attribute}"
        at = table.get(path) if isinstance(switch, Mapping) else switch
        done.append((kind, name, attribute, old, new, float(at or 1.0)))
        if at is None:
            refused.append(f"{path}: {old} -> {new}")
    unknown = set(table) - {f"{k}/{n}/{a}" for k, n, a, _, _ in differences}
    if unknown:
        raise ParameterError(
            f"switch for {sorted(unknown)}, which do not differ",
            f"{[f'{k}/{n}/{a}' for k, n, a, _, _ in differences]}",
            "Remove them.",
        )
    if refused:
        raise ParameterError(
            "discrete attributes that differ: " + "; ".join(refused),
            "equal ones, which can be interpolated around",
            "Make them equal, or name the alpha at which they switch: switch=0.5, or "
            "switch={'" + refused[0].split(":")[0] + "': 0.5, ...}.",
        )
    return tuple(done)
