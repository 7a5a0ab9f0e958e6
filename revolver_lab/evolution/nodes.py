"""A robot as the matching sees it: a tree of bodies with joints between them, and no more."""

from dataclasses import dataclass
from functools import cached_property

Pairs = list[tuple[int | None, int | None]]
# A joint by the body that it belongs to in the file, and its place there.
Joint = tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class Link:
    """A joint as the matching sees it.

    Attributes:
        name: Its name.
        type: "hinge", "slide" or "ball".
        drives: One label for each actuator on it; equal labels correspond.
        axis: Its axis at the reference pose, in the world, (3,).
    """

    name: str = ""
    type: str = "hinge"
    drives: tuple[str, ...] = ()
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Node:
    """A body as the matching sees it.

    Attributes:
        name: Its name.
        joints: Joints between it and its parent, outermost first; a free joint is not among them.
        drives: One label for each actuator on the body itself or on its sites.
        place: Where it is at the reference pose, in the world, (3,) [m].
        mocap: Whether nothing but its user moves it.
    """

    name: str = ""
    joints: tuple[Link, ...] = ()
    drives: tuple[str, ...] = ()
    place: tuple[float, ...] = (0.0, 0.0, 0.0)
    mocap: bool = False


@dataclass(frozen=True)
class Tree:
    """A robot: bodies under node 0, the world; a free body may be the root of its tree or not.

    Attributes:
        nodes: The bodies, the world first.
        parents: Index of each body's parent; -1 for the world.
        free: Indices of the children of the world that have a free joint.
    """

    nodes: tuple[Node, ...]
    parents: tuple[int, ...]
    free: frozenset[int] = frozenset()

    @cached_property
    def neighbours(self) -> tuple[tuple[int, ...], ...]:
        """For each body, the bodies that it is joined to; free bodies are joined to no world."""
        near: list[list[int]] = [[] for _ in self.nodes]
        for body, parent in enumerate(self.parents):
            if parent >= 0:
                near[parent].append(body)
                if body not in self.free:
                    near[body].append(parent)
        return tuple(map(tuple, near))

    def joints(self, body: int, parent: int) -> list[Joint]:
        """Joints between a body and the parent it hangs from, as (owner, index), outermost first.

        Hung from a body that was its child, the joints are the child's, in reverse.
        """
        owner = body if self.parents[body] == parent else parent
        joints = [(owner, index) for index in range(len(self.nodes[owner].joints))]
        return joints if owner == body else joints[::-1]

    def link(self, joint: Joint) -> Link:
        """The joint at (owner, index)."""
        return self.nodes[joint[0]].joints[joint[1]]

    def component(self, root: int) -> list[int]:
        """All bodies of the free tree with this root, the root first."""
        found = [root]
        for body in found:
            found += [near for near in self.neighbours[body] if near not in found]
        return found


@dataclass(frozen=True)
class Correspondence:
    """What corresponds in two trees.

    Attributes:
        bodies: Pairs of body indices; None where the body has to be created. (0, 0) is the world.
        joints: Pairs of joints as (owner, index), likewise.
        roots: For each pair of free trees, the pair of bodies at which they are rooted alike.
        created: Bodies, joints and actuators created on either side.
    """

    bodies: tuple[tuple[int | None, int | None], ...]
    joints: tuple[tuple[Joint | None, Joint | None], ...]
    roots: tuple[tuple[int, int], ...]
    created: int
