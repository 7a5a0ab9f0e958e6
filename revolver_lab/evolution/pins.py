"""What a user wants to correspond: names of bodies, of joints, and of the roots."""

import difflib

from revolver_lab.errors import MatchingError
from revolver_lab.evolution.nodes import Joint
from revolver_lab.evolution.skeleton import Skeleton


def pinned(
    skeletons: tuple[Skeleton, Skeleton], pins: dict[str, str]
) -> tuple[dict[int, int], dict[Joint, Joint]]:
    """Pins as indices of bodies and of joints."""
    bodies: dict[int, int] = {}
    joints: dict[Joint, Joint] = {}
    if len(set(pins.values())) < len(pins):
        raise MatchingError(
            f"pins={pins!r}, where two names share a partner", "one partner each", "Drop one pin."
        )
    for s, t in pins.items():
        a, b = skeletons
        if s in a.bodies and t in b.bodies:
            bodies[a.bodies[s]] = b.bodies[t]
        elif s in a.joints and t in b.joints:
            joints[a.joints[s]] = b.joints[t]
        else:
            _refuse_pin(skeletons, s, t)
    return bodies, joints


def _refuse_pin(skeletons: tuple[Skeleton, Skeleton], s: str, t: str) -> None:
    """Say which name of a pin is wrong, and which names come near."""
    for name, skeleton, where in ((s, skeletons[0], "source"), (t, skeletons[1], "target")):
        known = [*skeleton.bodies, *skeleton.joints]
        if name not in known:
            near = difflib.get_close_matches(str(name), known, n=5) or known[:5]
            raise MatchingError(
                f"the pin {s!r}: {t!r}, where the {where} has no body or joint {name!r}",
                f"names of two bodies or two joints, such as {', '.join(near)}",
                "Correct the name.",
            )
    raise MatchingError(
        f"the pin {s!r}: {t!r} of a body and a joint", "two bodies, or two joints", "Correct it."
    )


def pinned_root(
    skeletons: tuple[Skeleton, Skeleton], root: str | tuple[str | None, str | None] | None
) -> tuple[int | None, int | None]:
    """The wanted roots as indices; one name stands for whichever robots have it."""
    if root is None:
        return None, None
    both = isinstance(root, str)
    names = (root, root) if isinstance(root, str) else root
    if not isinstance(names, tuple | list) or len(names) != 2 or not all(
        name is None or isinstance(name, str) for name in names
    ):  # fmt: skip
        raise MatchingError(f"root = {root!r:.80}", "a body's name, or a pair (source, target)",
                            "Name a body of the robot.")  # fmt: skip
    found = [s.bodies.get(n) if n else None for s, n in zip(skeletons, names)]
    missing = [n for n, index in zip(names, found) if n and index is None]
    if missing and not (both and len(missing) == 1):
        known = list({**skeletons[0].bodies, **skeletons[1].bodies})
        near = difflib.get_close_matches(str(missing[0]), known, n=5) or known[:5]
        raise MatchingError(
            f"root={root!r}", f"a body of the robot, such as {', '.join(near)}", "Correct it."
        )
    return found[0], found[1]
