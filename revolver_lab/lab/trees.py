"""The morphology matching as two kinematic trees side by side (figure 2 of the paper)."""

import base64
import html
import io
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from revolver_lab.errors import SettingsError
from revolver_lab.evolution.matching import Matching
from revolver_lab.files import write_atomically
from revolver_lab.lab.encoders import check_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MATCHED, CREATED, INK = "#31629c", "#d9822b", "#3b4252"
_KINDS = ("bodies", "joints", "actuators")
_FORMATS = (".png", ".svg", ".pdf")

Levels = Iterable[tuple[str, str, int]]


@dataclass(frozen=True, kw_only=True)
class Node:
    """A body in a drawn tree.

    Attributes:
        body: Its name.
        parent: Name of its parent, "" for the world.
        key: The same word in both trees for bodies that correspond.
        created: Whether it is the other robot's and appears here at zero size.
    """

    body: str
    parent: str
    key: str
    created: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawing:
    """A figure and the words for those who cannot see it; a notebook shows both.

    Attributes:
        figure: A matplotlib figure.
        alt: What the figure shows, in words.
    """

    figure: "Figure" = field(repr=False)
    alt: str

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the figure as .png, .svg or .pdf, whole or not at all; returns the path."""
        checked = check_path(path, _FORMATS)
        return write_atomically(checked, self._bytes(checked.suffix[1:].lower()))

    def _bytes(self, kind: str) -> bytes:
        """The figure as a file."""
        buffer = io.BytesIO()
        self.figure.savefig(buffer, format=kind, dpi=110, facecolor="white")
        return buffer.getvalue()

    def _repr_html_(self) -> str:
        """An image with alt text."""
        data = base64.b64encode(self._bytes("png")).decode()
        words = html.escape(self.alt, quote=True)
        return f'<img alt="{words}" style="max-width:100%" src="data:image/png;base64,{data}"/>'


def show(matching: Matching) -> Drawing:
    """Draw what corresponds in two robots, and what was created where.

    Args:
        matching: `evolve.matching`.

    Returns:
        The drawing, with alt text.

    Raises:
        SettingsError: If it is given something else, such as the Evolution itself.
    """
    if not isinstance(matching, Matching):
        raise SettingsError(f"a {type(matching).__name__}", "a Matching", "Pass evolve.matching.")
    from matplotlib.figure import Figure

    sides = [padded_tree(matching, side) for side in (0, 1)]
    order = {node.key: rank for rank, node in enumerate(sides[0])}
    places = [_layout(nodes, order) for nodes in sides]
    figure = Figure(figsize=_size(sides, places), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for panel, name, nodes, at in zip(axes, ("source", "target"), sides, places, strict=True):
        created = sum(node.created for node in nodes)
        more = f", {created} created" if created else ""
        panel.set_title(f"{name}: {len(nodes) - created} bodies{more}", color=INK)
        _draw(panel, nodes, at)
    deepest = min([y for at in places for _, y in at.values()], default=0)
    axes[0].set_ylim(deepest - 0.5, 0.5)  # for both: they share it
    figure.supxlabel(_created_links(matching), fontsize=8, color=CREATED)
    return Drawing(figure=figure, alt=alt_text(matching))


def alt_text(matching: Matching) -> str:
    """What `show` draws, in words."""
    pairs = [pair for pair in matching.bodies if None not in pair]
    renamed = [f"{source} is {target}" for source, target in pairs if source != target]
    lines = [
        f"Two kinematic trees side by side. {len(pairs)} bodies of source and target correspond",
        f"({', '.join(renamed)})" if renamed else "by the same names",
    ]
    missing = []
    for kind in _KINDS:
        for source, target in getattr(matching, kind):
            if source is None or target is None:
                where = "source" if source is None else "target"
                missing.append(f"{_ONE[kind]} {source or target} in the {where}")
    told = f"created at zero size: {', '.join(missing)}" if missing else "nothing is created"
    return " ".join(lines) + f"; {told}."


_ONE = {"bodies": "body", "joints": "joint", "actuators": "actuator"}


def padded_tree(matching: Matching, side: int) -> list[Node]:
    """Bodies of one robot and those created in it, parents before children.

    Args:
        matching: What corresponds.
        side: 0 for the source, 1 for the target.
    """
    levels = (matching.source_levels, matching.target_levels)
    own, other = levels[side], levels[1 - side]
    twin = {pair[1 - side]: pair[side] for pair in matching.bodies}
    back = {pair[side]: pair[1 - side] for pair in matching.bodies}
    nodes = []
    for body, parent, _ in own:
        key = body if side == 0 else back.get(body) or f"+{body}"
        nodes.append(Node(body=body, parent=parent, key=key, created=False))
    names = {node.body for node in nodes}
    here = {body: str(twin[body]) for body, _, _ in other if twin.get(body) is not None}
    for body, parent, _ in other:
        if body in here:
            continue
        here[body] = body if body not in names else f"{body} (new)"
        key = f"+{body}" if side == 0 else body
        nodes.append(Node(body=here[body], parent=here.get(parent, ""), key=key, created=True))
    return nodes


Places = dict[str, tuple[float, float]]


def _layout(nodes: list[Node], order: dict[str, int]) -> Places:
    """Place of each body: leaves in a row from left to right, parents above their children."""
    known = {node.body for node in nodes}
    children: dict[str, list[str]] = {}
    for node in sorted(nodes, key=lambda node: order.get(node.key, len(order))):
        children.setdefault(node.parent if node.parent in known else "", []).append(node.body)
    places: Places = {}
    leaves = 0

    def place(body: str, depth: int) -> float:
        nonlocal leaves
        below = [place(child, depth + 1) for child in children.get(body, [])]
        x = sum(below) / len(below) if below else float(leaves)
        leaves += not below
        places[body] = (x, -depth)
        return x

    for root in children.get("", []):
        place(root, 0)
    return places


def _size(sides: list[list[Node]], places: list[Places]) -> tuple[float, float]:
    """Width and height of the figure [inches], so that no two names overlap."""
    across = max([x for at in places for x, _ in at.values()], default=0.0) + 1.4
    down = max([-y for at in places for _, y in at.values()], default=0) + 1
    longest = max([len(node.body) for nodes in sides for node in nodes], default=1)
    return max(6.0, 2 * across * (0.3 + 0.075 * longest)), 1.0 + 0.55 * down


def _draw(axes: "Axes", nodes: list[Node], places: Places) -> None:
    """Draw one tree; what was created is dashed and in the second colour."""
    for node in nodes:
        colour, style = (CREATED, "--") if node.created else (MATCHED, "-")
        x, y = places[node.body]
        if node.parent in places:
            above_x, above_y = places[node.parent]
            axes.plot([above_x, x], [above_y, y], style, color=colour, linewidth=1.4, zorder=1)
        box = {"boxstyle": "round,pad=0.3", "edgecolor": colour, "facecolor": "white",
               "linestyle": style, "linewidth": 1.4}  # fmt: skip
        axes.text(x, y, node.body, ha="center", va="center", fontsize=8, color=INK, bbox=box)
    across = [x for x, _ in places.values()] or [0.0]
    axes.set_xlim(min(across) - 0.7, max(across) + 0.7)
    axes.axis("off")


def _created_links(matching: Matching) -> str:
    """The joints and actuators that were created, which the trees of bodies do not show."""
    parts = []
    for kind in ("joints", "actuators"):
        lone = [source or target for source, target in getattr(matching, kind)
                if source is None or target is None]  # fmt: skip
        if lone:
            parts.append(f"{kind} created: {', '.join(map(str, lone))}")
    return "   ".join(parts)
