"""Which geoms may touch at either end, where trees, exclusions and pairs tell it differently."""

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import mujoco
import numpy as np

from revolver_lab.evolution.canonical import Element, Pairs
from revolver_lab.evolution.contacts import refuse_override
from revolver_lab.evolution.naming import free_name
from revolver_lab.evolution.shrinking import FREELY_SIZED

_DEEP = 10.0  # m; nothing of a robot gets deeper into the ground
_TOLD = ("condim", "solref", "solimp", "friction", "margin", "gap", "solreffriction", "adhesion")

Names = tuple[str, str]


class Touch:
    """Says which geoms of a robot MuJoCo looks at together.

    Args:
        model: A robot, compiled.
    """

    def __init__(self, model: mujoco.MjModel):
        self.model = model
        self._index = {model.geom(i).name: i for i in range(model.ngeom)}
        self._excluded = {(int(s) >> 16, int(s) & 0xFFFF) for s in model.exclude_signature}
        self._pairs = {frozenset(two) for two in zip(*map(np.ndarray.tolist, (
            model.pair_geom1, model.pair_geom2)))}  # fmt: skip
        off = int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
        self._families = not model.opt.disableflags & off

    def __call__(self, first: str, second: str) -> bool | None:
        """Whether two geoms may touch; None where one of them is not there."""
        if first not in self._index or second not in self._index:
            return None
        paired = frozenset((self._index[first], self._index[second])) in self._pairs
        return paired or (self.shapes(first, second) and self.bodies(first, second))

    def shapes(self, first: str, second: str) -> bool:
        """Whether their bit masks meet, and there is something to find between their shapes."""
        a, b = self._index[first], self._index[second]
        types, affinities = self.model.geom_contype, self.model.geom_conaffinity
        flat = all(mujoco.mjtGeom(self.model.geom_type[i]) in FREELY_SIZED for i in (a, b))
        return not flat and bool(types[a] & affinities[b] or types[b] & affinities[a])

    def bodies(self, first: str, second: str) -> bool:
        """Whether their bodies are neither welded together, nor parent and child, nor excluded."""
        model, names = self.model, (first, second)
        bodies = sorted(int(model.geom_bodyid[self._index[name]]) for name in names)
        weld = [int(model.body_weldid[i]) for i in bodies]
        above = [int(model.body_weldid[model.body_parentid[i]]) for i in weld]
        family = 0 not in weld and (weld[0] == above[1] or weld[1] == above[0])
        return (weld[0] != weld[1] and not (self._families and family)
                and (bodies[0], bodies[1]) not in self._excluded)  # fmt: skip


class End(NamedTuple):
    """One end of the path.

    Attributes:
        original: The robot there, as it was read.
        padded: The same with what was created, which is changed in place.
        grown: What touches in it so far.
        own: Its contact pairs, by the geoms that they name.
    """

    original: Touch
    padded: mujoco.MjSpec
    grown: Touch
    own: dict[frozenset[str], Element]


def align_contacts(
    source: mujoco.MjSpec, target: mujoco.MjSpec, padded: tuple[mujoco.MjSpec, mujoco.MjSpec],
    pairs: Pairs,
) -> None:  # fmt: skip
    """Let geoms touch at each end as they do in the robot that is there.

    What only one robot excludes, pairs, or leaves out because its bodies are welded, becomes a
    contact pair of both: at the end where nothing touches, its margin is deeper than the two can
    get into each other, and closes along the path. A pair says what MuJoCo would have found.

    Args:
        source: The source, as it was read.
        target: The target, as it was read.
        padded: Both with what was created; changed in place.
        pairs: For each kind of element, (name in source, name in target); "pair" is added to.

    Raises:
        ParameterError: If two may touch in one robot only, and margins mean nothing in one.
    """
    ends = [End(Touch(spec.compile()), grown, Touch(grown.compile()), _explicit(grown))
            for spec, grown in zip((source, target), padded)]  # fmt: skip
    here, there = ends
    shared = {a for a, _ in pairs["pair"]}
    known = {two for two, pair in here.own.items() if pair.name in shared}
    for first, second in combinations(pairs["geom"], 2):
        names: list[Names] = [*zip(first, second)]
        if frozenset(names[0]) in known:
            continue
        wanted = [end.original(*two) for end, two in zip(ends, names)]
        # E(1) has the numbers of the target in the source's tree, with the source's exclusions.
        found = [here.grown(*names[0]),
                 here.grown.bodies(*names[0]) and there.grown.shapes(*names[1])]  # fmt: skip
        differ = any(w not in (None, f) for w, f in zip(wanted, found))
        if differ or any(frozenset(two) in end.own for two, end in zip(names, ends)):
            pairs["pair"].append(_pair(ends, names, wanted))


def _explicit(spec: mujoco.MjSpec) -> dict[frozenset[str], Element]:
    """The contact pairs of a robot by the geoms that they name."""
    return {frozenset((pair.geomname1, pair.geomname2)): pair for pair in spec.pairs}


def _pair(ends: list[End], names: list[Names], wanted: list[bool | None]) -> Names:
    """Let both robots have a pair for two geoms, open or closed as each wants it."""
    told = [_told(end, two) if want else None for end, two, want in zip(ends, names, wanted)]
    deepest = max(_depth(end.grown.model, two) for end, two in zip(ends, names))
    if None in told:
        what = f"a contact of {names[0][0]!r} and {names[0][1]!r} that one of the robots alone has"
        refuse_override(what, *(end.original.model for end in ends))
    made = []
    for end, two, here, there in zip(ends, names, told, reversed(told)):
        pair = end.own.get(frozenset(two))
        if pair is None:
            taken = {other.name for other in end.padded.pairs}
            pair = end.padded.add_pair(name=free_name("_and_".join(two), taken),
                                       geomname1=two[0], geomname2=two[1])  # fmt: skip
        _write(pair, here or there or {})
        if here is None:
            pair.margin, pair.gap = -deepest, 0.0
        made.append(pair.name)
    return made[0], made[1]


def _told(end: End, two: Names) -> dict[str, object]:
    """What a contact of two geoms is like, by their pair or by MuJoCo's rules of mixing."""
    own = end.own.get(frozenset(two))
    if own is not None:
        return {name: np.array(getattr(own, name)) for name in _TOLD}
    return mixed(end.original.model, *two)


def mixed(model: mujoco.MjModel, first: str, second: str) -> dict[str, object]:
    """Return what MuJoCo makes of two geoms that touch.

    Source: https://mujoco.readthedocs.io/en/stable/modeling.html#contact-parameters; margins and
    gaps add up, and so does adhesion between geoms of the same priority.

    Args:
        model: A robot, compiled.
        first: Name of a geom.
        second: Name of another.
    """
    a, b = model.geom(first), model.geom(second)
    weights = np.array([a.solmix[0], b.solmix[0]], float)
    equal = a.priority[0] == b.priority[0]
    if not equal:
        weights = np.array([a.priority[0] > b.priority[0], b.priority[0] > a.priority[0]], float)
        leading = a if weights[0] else b
        condim, friction, sticks = leading.condim[0], leading.friction, [leading.id]
    else:
        condim, sticks = max(a.condim[0], b.condim[0]), [a.id, b.id]
        friction = np.maximum(a.friction, b.friction)
    weights = np.full(2, 0.5) if weights.sum() < mujoco.mjMINVAL else weights / weights.sum()
    solref = weights @ np.array([a.solref, b.solref])
    if equal and min(a.solref[0], b.solref[0]) <= 0:  # stiffness and damping are not mixed
        solref = np.minimum(a.solref, b.solref)
    return {
        "condim": int(condim), "solref": solref, "solimp": weights @ [a.solimp, b.solimp],
        "friction": friction[[0, 0, 1, 2, 2]], "margin": float(a.margin[0] + b.margin[0]),
        "gap": float(a.gap[0] + b.gap[0]), "adhesion": float(model.geom_adhesion[sticks].sum()),
    }  # fmt: skip


def _write(pair: Element, told: Mapping[str, object]) -> None:
    """Set what a pair is like."""
    for name, value in told.items():
        array = np.array(value)
        setattr(pair, name, array if array.ndim else array.item())


def _depth(model: mujoco.MjModel, two: Names) -> float:
    """How deep two geoms can get into each other [m]."""
    ids = [model.geom(name).id for name in two]
    if any(mujoco.mjtGeom(model.geom_type[i]) in FREELY_SIZED for i in ids):
        return _DEEP
    return float(sum(model.geom_rbound[i] for i in ids)) + 1e-3
