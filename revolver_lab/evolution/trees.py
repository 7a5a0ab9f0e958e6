"""Finds the correspondence of two kinematic trees that creates the fewest nodes."""

import math
from collections import Counter

import numpy as np
from scipy.optimize import linear_sum_assignment

from revolver_lab.evolution.likeness import (
    Weights,
    away,
    crossing,
    joint_unlikeness,
    pair_in_order,
    words,
)
from revolver_lab.evolution.nodes import Correspondence, Joint, Pairs, Tree

IMPOSSIBLE = 1e6


class Matcher:
    """Finds the cheapest correspondence by dynamic programming over pairs of hanging bodies.

    A pair (body, parent it hangs from) x (body, parent) costs what its own joints and actuators
    create, plus the cheapest assignment of the children that hang from the two (Hungarian
    algorithm), where a child without a partner costs its whole subtree.

    Args:
        source: The one tree.
        target: The other.
        pinned: Body indices that must correspond, source to target.
        pinned_joints: The same for joints, as (owner, index).
        roots: Pairs of roots allowed for free trees; None allows all.
    """

    def __init__(
        self,
        source: Tree,
        target: Tree,
        pinned: dict[int, int] | None = None,
        pinned_joints: dict[Joint, Joint] | None = None,
        roots: tuple[int | None, int | None] = (None, None),
    ):
        self.trees = source, target
        self._pins = pinned or {}, {t: s for s, t in (pinned or {}).items()}
        joints = pinned_joints or {}
        self._joint_pins = joints, {t: s for s, t in joints.items()}
        self._roots = roots
        parts = sum(1 + len(node.joints) for tree in self.trees for node in tree.nodes)
        self._weights = Weights.for_parts(parts, max(1, len(source.free)))
        self._words = [[words(node.name) for node in tree.nodes] for tree in self.trees]
        self._known: dict[tuple[int, int, int, int], float] = {}
        self._alone: dict[tuple[int, int, int], float] = {}

    def solve(self) -> Correspondence:
        """The cheapest correspondence.

        Returns:
            The correspondence; `created` is at least IMPOSSIBLE where the pins leave none.
        """
        bodies: Pairs = []
        joints: list = []
        roots: list = []
        total = self._pair(0, -1, 0, -1)
        self._collect((0, -1, 0, -1), bodies, joints, roots)
        left = [set(range(len(t.nodes))) - {p[k] for p in bodies} for k, t in enumerate(self.trees)]
        bodies += [(s, None) for s in sorted(left[0])] + [(None, t) for t in sorted(left[1])]
        for k, tree in enumerate(self.trees):
            every = [(b, i) for b, node in enumerate(tree.nodes) for i in range(len(node.joints))]
            gone = {pair[k] for pair in joints}
            joints += [(j, None) if k == 0 else (None, j) for j in every if j not in gone]
        created = math.floor(total + 1e-7)
        return Correspondence(tuple(bodies), tuple(joints), tuple(roots), created)

    def _pair(self, u: int, pu: int, v: int, pv: int) -> float:
        """Cost of matching body u hanging from pu with body v hanging from pv."""
        key = (u, pu, v, pv)
        if key not in self._known:
            self._known[key] = self._cost(*key)
        return self._known[key]

    def _cost(self, u: int, pu: int, v: int, pv: int) -> float:
        """The cost, not yet known."""
        free = self._is_free(0, u, pu), self._is_free(1, v, pv)
        if free[0] != free[1]:
            return IMPOSSIBLE
        if free[0]:
            return self._rooted(u, v)[0]
        cost = self._own_cost(u, pu, v, pv) + self._joint_pairs(u, pu, v, pv)[0]
        return cost + self._children(u, pu, v, pv)[0]

    def _is_free(self, side: int, body: int, parent: int) -> bool:
        """Whether a body hangs freely in the world, so that its tree may be rooted elsewhere."""
        return parent == 0 and body in self.trees[side].free

    def _rooted(self, u: int, v: int) -> tuple[float, int, int]:
        """The cheapest pair of roots for two free trees: (cost, source root, target root).

        Where several bodies float, each keeps the root that it has.
        """
        best = (math.inf, u, v)
        wanted = self._roots
        alone = all(len(tree.free) == 1 for tree in self.trees)
        for r in self.trees[0].component(u) if alone else [u]:
            for s in self.trees[1].component(v) if alone else [v]:
                if wanted[0] not in (None, r) or wanted[1] not in (None, s):
                    continue
                moved = self._weights.root * (2 * (r != u) + (s != v))
                cost = self._pair(r, -1, s, -1) + moved
                best = min(best, (cost, r, s), key=lambda option: option[0])
        return best if math.isfinite(best[0]) else (IMPOSSIBLE, u, v)

    def _own_cost(self, u: int, pu: int, v: int, pv: int) -> float:
        """What two matched bodies cost by themselves; their likeness settles ties."""
        if self._pins[0].get(u, v) != v or self._pins[1].get(v, u) != u:
            return IMPOSSIBLE
        a, b = self.trees[0].nodes[u], self.trees[1].nodes[v]
        if a.mocap != b.mocap:  # there is nothing between
            return IMPOSSIBLE
        unlike = 0.0
        if pu >= 0 and pv >= 0:
            above = self.trees[0].nodes[pu].place, self.trees[1].nodes[pv].place
            unlike = away(a.place, above[0], b.place, above[1])
        shared = self._words[0][u] & self._words[1][v]
        either = self._words[0][u] | self._words[1][v]
        unlike += 1.0 - len(shared) / max(1, len(either))
        tie = self._weights.likeness * unlike + self._weights.order * abs(u - v)
        return _differing(a.drives, b.drives) + tie + self._weights.name * (a.name != b.name)

    def _joint_pairs(self, u: int, pu: int, v: int, pv: int) -> tuple[float, list]:
        """Cheapest pairing of the joints above two matched bodies: (cost, pairs of joints)."""
        if pu < 0 or pv < 0:
            return 0.0, []
        ours = self.trees[0].joints(u, pu)
        theirs = self.trees[1].joints(v, pv)
        links = [self.trees[0].link(j) for j in ours], [self.trees[1].link(j) for j in theirs]

        def pair(i: int, j: int) -> float:
            """Cost of making one joint of the other."""
            a, b = links[0][i], links[1][j]
            pins = self._joint_pins
            ok = pins[0].get(ours[i], theirs[j]) == theirs[j]
            ok = ok and pins[1].get(theirs[j], ours[i]) == ours[i]
            if a.type != b.type or not ok:
                return IMPOSSIBLE
            if not pins[0].keys() & set(ours) and crossing(a, b, *links):
                return IMPOSSIBLE
            tie = self._weights.likeness * joint_unlikeness(a.axis, b.axis)
            tie += self._weights.order * abs(i - j) + self._weights.name * (a.name != b.name)
            return _differing(a.drives, b.drives) + tie

        alone = [self._joint_alone(0, j) for j in ours], [self._joint_alone(1, j) for j in theirs]
        slides = [[link.type == "slide" for link in side] for side in links]
        cost, pairs = pair_in_order(pair, alone, slides)
        return cost, [(ours[i], theirs[j]) for i, j in pairs]

    def _joint_alone(self, side: int, joint: Joint) -> float:
        """What creating one joint and its actuators on the other side costs."""
        if joint in self._joint_pins[side]:
            return IMPOSSIBLE
        return 1.0 + len(self.trees[side].link(joint).drives)

    def _subtree(self, side: int, body: int, parent: int) -> float:
        """What creating a whole hanging subtree on the other side costs."""
        key = (side, body, parent)
        if key not in self._alone:
            tree, node = self.trees[side], self.trees[side].nodes[body]
            cost = 1.0 + len(node.drives) + IMPOSSIBLE * (body in self._pins[side])
            cost += sum(self._joint_alone(side, joint) for joint in tree.joints(body, parent))
            below = (near for near in tree.neighbours[body] if near != parent)
            self._alone[key] = cost + sum(self._subtree(side, near, body) for near in below)
        return self._alone[key]

    def _children(self, u: int, pu: int, v: int, pv: int) -> tuple[float, list[tuple[int, int]]]:
        """Cheapest assignment of the children of two matched bodies: (cost, pairs)."""
        ours = [near for near in self.trees[0].neighbours[u] if near != pu]
        theirs = [near for near in self.trees[1].neighbours[v] if near != pv]
        alone = (
            np.array([self._subtree(0, body, u) for body in ours]),
            np.array([self._subtree(1, body, v) for body in theirs]),
        )
        cost = float(alone[0].sum() + alone[1].sum())
        if not ours or not theirs:
            return cost, []
        together = np.array([[self._pair(s, u, t, v) for t in theirs] for s in ours])
        gain = np.minimum(together - alone[0][:, None] - alone[1], 0.0)
        rows, columns = linear_sum_assignment(gain)
        pairs = [(ours[i], theirs[j]) for i, j in zip(rows, columns) if gain[i, j] < 0.0]
        return cost + float(gain[rows, columns].sum()), pairs

    def _collect(self, key: tuple[int, int, int, int], bodies: Pairs, joints: list, roots: list):
        """Follow the cheapest choices from one matched pair downwards."""
        u, pu, v, pv = key
        if self._is_free(0, u, pu) and self._is_free(1, v, pv):
            _, u, v = self._rooted(u, v)
            roots.append((u, v))
            pu = pv = -1
        bodies.append((u, v))
        joints += self._joint_pairs(u, pu, v, pv)[1]
        for s, t in self._children(u, pu, v, pv)[1]:
            self._collect((s, u, t, v), bodies, joints, roots)


def _differing(a: tuple[str, ...], b: tuple[str, ...]) -> int:
    """How many labels have no partner in the other list.

    Example:
        >>> _differing(("joint", "joint"), ("joint", "tendon"))
        2
    """
    ours, theirs = Counter(a), Counter(b)
    return sum(((ours - theirs) + (theirs - ours)).values())
