"""How alike two bodies or two joints are: what decides between equally cheap correspondences."""

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from revolver_lab.evolution.nodes import Link

_ASKEW = 0.5
"""Cosine below which two axes are not each other's kin."""


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Prices of unlikeness, each sum of them smaller than the next more important price.

    The order of importance is: nodes created (price 1), roots moved, names, likeness, order.

    Attributes:
        root: Of moving a root; moving the source's counts twice.
        name: Of two names that differ.
        likeness: Of unlikeness, which is between 0 and 2 for a pair.
        order: Of each place in the order of the file.
    """

    root: float
    name: float
    likeness: float
    order: float

    @classmethod
    def for_parts(cls, parts: int, trees: int = 1) -> "Weights":
        """Prices for two robots of so many bodies and joints together, and so many free trees.

        Example:
            >>> weights = Weights.for_parts(10)
            >>> weights.name * 10 < weights.root < 0.25
            True
        """
        root = 0.1 / trees
        name = root / (4 * parts)
        likeness = name / (8 * parts)
        return cls(root=root, name=name, likeness=likeness, order=likeness / (8 * parts**2))


def words(name: str) -> frozenset[str]:
    """The words and numbers in a name.

    Example:
        >>> sorted(words("Left_leg2/hip"))
        ['2', 'hip', 'left', 'leg']
    """
    return frozenset(re.findall(r"[a-z]+|[0-9]+", name.lower()))


def away(
    a: Sequence[float], above_a: Sequence[float], b: Sequence[float], above_b: Sequence[float]
) -> float:
    """How differently two bodies are placed seen from their parents, between 0 and 1."""
    first, second = np.subtract(a, above_a), np.subtract(b, above_b)
    lengths = float(np.linalg.norm(first) + np.linalg.norm(second))
    return float(np.linalg.norm(first - second)) / lengths if lengths > 1e-9 else 0.0


def joint_unlikeness(a: Sequence[float], b: Sequence[float]) -> float:
    """How differently two axes point, between 0 (the same way) and 1 (opposite)."""
    return float(1.0 - np.dot(a, b)) / 2.0


def crossing(a: Link, b: Link, ours: Sequence[Link], theirs: Sequence[Link]) -> bool:
    """Whether two joints of one body would change places, and their axes turn into each other's.

    Halfway both axes would be one: two coordinates for one motion, and no inertia matrix.

    Args:
        a: A joint of one robot.
        b: A joint of the other.
        ours: All joints of a's body.
        theirs: All joints of b's.
    """
    named = {link.name for link in theirs}, {link.name for link in ours}
    turns = abs(float(np.dot(a.axis, b.axis))) < _ASKEW
    return a.name != b.name and a.name in named[0] and b.name in named[1] and turns


def pair_in_order(
    pair: Callable[[int, int], float],
    alone: tuple[list[float], list[float]],
    slides: list[list[bool]],
) -> tuple[float, list[tuple[int, int]]]:
    """Cheapest pairing of two lists of joints that keeps their order.

    Rotations do not commute, so pairs may not cross; slides next to each other do commute and
    may. The sum over pairs of `pair(i, j)` plus `alone` for the rest is least.

    Args:
        pair: Cost of pairing joint i of the first list with joint j of the second.
        alone: Cost of each joint without a partner, for both lists.
        slides: For both lists, which joints are slides.

    Returns:
        The cost, and the pairs (i, j).

    Example:
        >>> pair_in_order(lambda i, j: float(i == j), ([1.0, 1.0], [1.0, 1.0]), [[True] * 2] * 2)
        (0.0, [(0, 1), (1, 0)])
    """
    best: tuple[float, list[tuple[int, int]]] = (float("inf"), [])
    for order in _orders(slides[1]):
        theirs = [alone[1][k] for k in order]
        cost, pairs = _align(lambda i, j, order=order: pair(i, order[j]), alone[0], theirs)
        if cost < best[0]:
            best = cost, [(i, order[j]) for i, j in pairs]
    return best


def _orders(slides: list[bool]) -> list[list[int]]:
    """Every order of the joints in which only neighbouring slides change places."""
    runs: list[list[list[int]]] = []
    for is_slide, group in itertools.groupby(range(len(slides)), key=lambda k: slides[k]):
        run = list(group)
        many = is_slide and len(run) <= 4
        runs.append([list(p) for p in itertools.permutations(run)] if many else [run])
    return [list(itertools.chain(*choice)) for choice in itertools.product(*runs)]


def _align(
    pair: Callable[[int, int], float], ours: list[float], theirs: list[float]
) -> tuple[float, list[tuple[int, int]]]:
    """Cheapest alignment of two sequences without crossings (Needleman and Wunsch)."""
    rows: list[list[tuple[float, list[tuple[int, int]]]]] = []
    for i in range(len(ours) + 1):
        row: list[tuple[float, list[tuple[int, int]]]] = []
        for j in range(len(theirs) + 1):
            options = [(0.0, [])] if i == j == 0 else []
            if i and j:
                cost, pairs = rows[i - 1][j - 1]
                options.append((cost + pair(i - 1, j - 1), [*pairs, (i - 1, j - 1)]))
            if i:
                options.append((rows[i - 1][j][0] + ours[i - 1], rows[i - 1][j][1]))
            if j:
                options.append((row[j - 1][0] + theirs[j - 1], row[j - 1][1]))
            row.append(min(options, key=lambda option: option[0]))
        rows.append(row)
    return rows[-1][-1]
