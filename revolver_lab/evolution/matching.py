"""Finds what corresponds in two robots, so that the fewest bodies, joints and actuators appear."""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.nodes import Correspondence
from revolver_lab.evolution.pins import pinned, pinned_root
from revolver_lab.evolution.skeleton import Skeleton
from revolver_lab.evolution.trees import IMPOSSIBLE, Matcher
from revolver_lab.evolution.twins import Names, match_elements

_MAX_BODIES = 400


@dataclass(frozen=True, kw_only=True)
class Matching:
    """What corresponds in two robots; None where an element has to be created.

    Each kind holds pairs (name in source, name in target). `str(matching)` shows the two trees
    side by side.

    Attributes:
        bodies: Without the world.
        joints: Joints.
        actuators: Actuators.
        geoms: Geoms; of the world's, only those that both robots have.
        sites: Sites.
        tendons: Tendons.
        equalities: Equality constraints.
        sensors: Sensors.
        pairs: Explicit contact pairs.
        excludes: Excluded contacts.
        meshes: Meshes of paired geoms.
        scenery: The world's geoms that only one robot has, and planes and height fields on any
            body: the source's are there at every alpha, the target's at none.
        source_root: Body at which a floating source is rooted as the target is; "" if fixed.
        target_root: The same of the target.
        created: Bodies, joints and actuators created on either side.
        source_levels: For the source's tree in drawing order, (body, parent, depth).
        target_levels: The same of the target.
        unchained: Whether links that are welded to each other were hung from one of them.
    """

    bodies: Names
    joints: Names
    actuators: Names
    geoms: Names
    sites: Names
    tendons: Names
    equalities: Names
    sensors: Names
    pairs: Names
    excludes: Names
    meshes: Names
    scenery: Names
    source_root: str
    target_root: str
    created: int
    source_levels: tuple[tuple[str, str, int], ...]
    target_levels: tuple[tuple[str, str, int], ...]
    unchained: bool

    def __str__(self) -> str:
        """Both trees side by side, with what has to be created marked by a plus."""
        return "\n".join(self._lines())

    def _lines(self) -> list[str]:
        """One line for each body: in the source, in the target, and its joints."""
        rows = self._rows()
        width = max(len("source"), *(len(left) for left, _ in rows)) + 3
        head = f"{'source':<{width}}target   (+ is created; {self.created} nodes in all)"
        joints = [f"+ joint {a or b} in the {'target' if a else 'source'}"
                  for a, b in self.joints if a is None or b is None]  # fmt: skip
        actuators = [f"+ actuator {a or b} in the {'target' if a else 'source'}"
                     for a, b in self.actuators if a is None or b is None]  # fmt: skip
        roots = []
        if self.target_root and self.target_levels[0][0] != self.target_root:
            roots = [f"rooted alike at {self.source_root} and {self.target_root}"]
        if self.unchained:
            roots += ["links that are welded to each other hang from one of them"]
        body = [f"{left:<{width}}{right}" for left, right in rows]
        scene = [f"= {a} of the scene stays" if a else f"- {b} of the target's scene is left out"
                 for a, b in self.scenery]  # fmt: skip
        return [head, *body, *roots, *joints, *actuators, *scene]

    def _rows(self) -> list[tuple[str, str]]:
        """Indented names: the source's tree, and under each body what only the target has there."""
        twin = {s: t for s, t in self.bodies if s is not None}
        back = {t: s for s, t in self.bodies if t is not None}
        lone: dict[str, list[str]] = {}
        for body, parent, _ in self.target_levels:
            if back.get(body) is None:
                lone.setdefault(back.get(parent) or f"+{parent}", []).append(body)

        rows: list[tuple[str, str]] = []

        def add_lone(parent: str, depth: int) -> None:
            """Add what only the target has under one body."""
            for body in lone.get(parent, []):
                rows.append(("  " * depth + f"+{body}", "  " * depth + body))
                add_lone(f"+{body}", depth + 1)

        for body, _, depth in self.source_levels:
            rows.append(("  " * depth + body, "  " * depth + (twin.get(body) or f"+{body}")))
            add_lone(body, depth + 1)
        add_lone("+world", 0)
        return rows


def match(
    source: mujoco.MjSpec,
    target: mujoco.MjSpec,
    *,
    pins: Mapping[str, str] | None = None,
    root: str | tuple[str | None, str | None] | None = None,
    switching: bool = False,
) -> Matching:
    """Find the correspondence that creates the fewest bodies, joints and actuators.

    Bodies correspond from the roots down, joints of one type within corresponding bodies, and
    actuators that drive corresponding things; this is the morphology matching of section 4.1.
    The root of a floating robot may be any of its bodies. Between equally cheap correspondences,
    the files' own roots are kept, then equal names win, then likeness of place, axis and words.
    What a tendon drives is matched afterwards and does not count in the choice. A geom that touches
    things and one that is only drawn do not correspond, unless they are to be switched.

    Args:
        source: A robot from `read_robot`.
        target: Another.
        pins: Names that must correspond, of two bodies or of two joints, source to target.
        root: Body at which both floating robots are rooted, one name or (source's, target's).
        switching: Whether what is discrete may differ, since it is switched on the way.

    Returns:
        The correspondence.

    Raises:
        MatchingError: If one robot floats and the other is welded to the world, or a pin or root
            names nothing or cannot be.
    """
    named = isinstance(pins, Mapping | None) and all(
        isinstance(name, str) for pair in (pins or {}).items() for name in pair
    )
    if not named:
        raise MatchingError(
            f"pins={pins!r}", "a mapping of names", "Write pins={'source_name': 'target_name'}."
        )
    skeletons = Skeleton(source), Skeleton(target)
    _check_bases(skeletons)
    bodies, joints = pinned(skeletons, dict(pins or {}))
    matcher = Matcher(
        skeletons[0].tree, skeletons[1].tree, bodies, joints, pinned_root(skeletons, root)
    )
    found = matcher.solve()
    if found.created >= IMPOSSIBLE:
        raise MatchingError(
            f"pins={dict(pins or {})!r}, root={root!r}",
            "pins whose parents correspond too, of one type, one partner each",
            "Pin the bodies above them, choose another root, or leave a pin out.",
        )
    _check_floating_twins(skeletons, found)
    return _named(skeletons, found, switching)


def _check_bases(skeletons: tuple[Skeleton, Skeleton]) -> None:
    """Refuse a floating robot against a welded one, and robots too large to search."""
    floats = [bool(skeleton.tree.free) for skeleton in skeletons]
    if floats[0] != floats[1]:
        names = ["floats", "is welded to the world, or slides on it"]
        tree = skeletons[floats[1]].tree
        free = ", ".join(tree.nodes[body].name for body in sorted(tree.free))
        raise MatchingError(
            f"the source {names[not floats[0]]} and the target {names[not floats[1]]} "
            f"(floating: {free})",
            "two robots with a free joint, or two without",
            "Add a <freejoint/> to the root of the one without, in place of any joints there (in a "
            "URDF, a joint of type floating from a link named world), or remove the other's.",
        )
    for skeleton in skeletons:
        size = max(len(skeleton.tree.nodes), 4 * skeleton.depth())
        if size > _MAX_BODIES:
            raise MatchingError(
                f"a robot of {len(skeleton.tree.nodes)} bodies, {skeleton.depth()} deep",
                f"at most {_MAX_BODIES} bodies, {_MAX_BODIES // 4} deep",
                "Leave out bodies that belong to the scene.",
            )


def _check_floating_twins(skeletons: tuple[Skeleton, Skeleton], found: Correspondence) -> None:
    """Refuse to create a floating body: nothing would hold it."""
    for side, skeleton in enumerate(skeletons):
        matched = {pair[side] for pair in found.bodies if None not in pair}
        for root in skeleton.tree.free:
            if matched.isdisjoint(skeleton.tree.component(root)):
                raise MatchingError(
                    f"the floating body {skeleton.tree.nodes[root].name!r} without a partner",
                    "as many floating bodies in the source as in the target",
                    "Add it to the other robot, or remove it from this one.",
                )


def _named(
    skeletons: tuple[Skeleton, Skeleton], found: Correspondence, switching: bool
) -> Matching:
    """The correspondence by names, with everything that hangs on bodies and joints."""
    a, b = skeletons
    bodies = tuple(
        (None if s is None else a.tree.nodes[s].name, None if t is None else b.tree.nodes[t].name)
        for s, t in found.bodies
        if s != 0
    )
    joints = tuple(
        (None if s is None else a.tree.link(s).name, None if t is None else b.tree.link(t).name)
        for s, t in found.joints
    )
    joints = _free_joints(skeletons, found) + joints
    others = match_elements(a.spec, b.spec, dict(bodies), dict(joints), switching)
    lone = [p for kind in (bodies, joints, others["actuators"]) for p in kind if None in p]
    roots = found.roots[0] if found.roots else None
    return Matching(
        bodies=bodies,
        joints=joints,
        **others,
        source_root=a.tree.nodes[roots[0]].name if roots else "",
        target_root=b.tree.nodes[roots[1]].name if roots else "",
        created=len(lone),
        source_levels=a.levels(),
        target_levels=b.levels(),
        unchained=False,
    )


def _free_joints(skeletons: tuple[Skeleton, Skeleton], found: Correspondence) -> Names:
    """The free joints of trees that correspond; moving a root moves its free joint."""
    a, b = skeletons
    return tuple((a.free_joint(r), b.free_joint(s)) for r, s in found.roots)
