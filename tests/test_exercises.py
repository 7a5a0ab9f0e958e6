"""Exercises: a right answer is praised, a wrong one is told its misconception, none fails."""

from pathlib import Path

import jupytext
import numpy as np

import revolver_lab as rvl
from revolver_lab.evolution.lifting import lift
from revolver_lab.evolution.reading import read_robot
from revolver_lab.exercises import points_on_a_path as checks

NOTEBOOK = Path(__file__).parent.parent / "notebooks" / "01_points_on_a_path.py"
HALF_TURN = np.deg2rad(-60) / 2


def _ball(radius: float) -> float:
    return 1000 * 4 / 3 * np.pi * radius**3


def _radius(alpha: float) -> float:
    return 0.03 + 0.02 * alpha


def _mass(alpha: float) -> float:
    return _ball(_radius(alpha))


def _turn(alpha: float) -> np.ndarray:
    return np.array([np.cos(HALF_TURN * alpha), 0, np.sin(HALF_TURN * alpha), 0])


def _lerp(alpha: float) -> np.ndarray:
    return (1 - alpha) * _turn(0) + alpha * _turn(1)


def _smoothstep(x: float) -> float:
    return x * x * (3 - 2 * x)


RIGHT = {
    "one": [lambda q: [q[0], 0, q[1], 0], lambda q: np.insert(q, [1, 2], 0.0)],
    "two": [
        lambda alpha: (_mass(alpha), _turn(alpha)),
        lambda alpha: [_mass(alpha), list(-_turn(alpha))],  # q and -q are one rotation
    ],
    "three": [
        lambda alpha: _smoothstep(max(0.0, 2 * alpha - 1)),
        lambda alpha: (1 - np.cos(np.pi * np.clip(2 * alpha - 1, 0, 1))) / 2,
        lambda alpha: max(0.0, 2 * alpha - 1) ** 2,  # steep at the end, which is no corner
        lambda alpha: _smoothstep(np.clip(4 * alpha - 2, 0, 1)),  # and there by 3/4
    ],
}

WRONG = {
    "one": [
        (lambda q: [*q, 0, 0], "The zeros are at the end"),
        (lambda q: [0, 0, *q], "`knuckle` arrived at `base`"),
        (lambda q: [q[0], 0, 0, q[1]], "`base` arrived at `little`"),
        (lambda q: [0, q[0], 0, q[1]], "`knuckle` arrived at `tip`"),
        (lambda q: [q[1], 0, q[0], 0], "`knuckle` arrived at `base`"),
        (lambda q: [q[0], q[0], q[1], q[1]], "rests at zero"),
        (lambda q: [q[0], 1, q[1], 1], "rests at zero"),
        (lambda q: [0, 0, 0, 0], "is lost"),
        (lambda q: q, "Nothing was inserted"),
        (lambda q: [q[0], 0, q[1]], r"shape \(3,\); 4 numbers"),
        (lambda q: [q[0], float("nan"), q[1], 0], "not finite"),
        ([0.3, 0, -0.2, 0], "a function is asked for"),
    ],
    "two": [
        (lambda a: ((1 - a) * _mass(0) + a * _mass(1), _turn(a)), "You interpolated the mass"),
        (lambda a: (_mass(1 - a), _turn(a)), "the ends are swapped"),
        (lambda a: (_mass(a) / 1000, _turn(a)), "That is the volume"),
        (lambda a: (_ball(2 * _radius(a)), _turn(a)), "you doubled the radius"),
        (lambda a: (_ball(_radius(a) / 2), _turn(a)), "you halved the radius"),
        (lambda a: (np.pi * _radius(a) ** 2, _turn(a)), "the pad weighs"),
        (lambda a: (_mass(a), _lerp(a)), "That is lerp"),
        (lambda a: (_mass(a), _lerp(a) / np.linalg.norm(_lerp(a))), "normalised lerp"),
        (lambda a: (_mass(a), np.roll(_turn(a), -1)), r"MuJoCo writes \(w, x, y, z\)"),
        (lambda a: (_mass(a), _turn(-a)), "the wrong way"),
        (lambda a: (_mass(a), _turn(2 * a)), "half the angle"),
        (lambda a: (_mass(a), _turn(np.rad2deg(a))), "degrees for radians"),
        (lambda a: (_mass(a), _turn(1 - a)), "swapped"),
        (lambda a: (_mass(a), [1, 0, 0, 0]), "At alpha = 0.5 your thumb"),
        (lambda a: _mass(a), "Return two things"),
        (lambda a: (_mass(a), 0.3), "4 numbers are needed"),
        (lambda a: ([_mass(a)], _turn(a)), "one number is needed"),
        (lambda a: (_mass(a), "turned"), "no number"),
    ],
    "three": [
        (lambda a: _smoothstep(max(0.0, a - 0.5)), r"f\(1\) = 1 is needed"),
        (lambda a: 0.0, r"f\(1\) = 1 is needed"),
        (lambda a: 1 - _smoothstep(a), r"f\(1\) = 1 is needed"),
        (lambda a: _smoothstep(2 * a - 1), r"f\(0\) = 0 is needed"),
        (lambda a: a if a < 0.5 else _smoothstep(a) + 3 * a * (1 - a), "f leaves"),
        (lambda a: float(a > 0.5), "f jumps"),
        (lambda a: a, "changes from the start"),
        (_smoothstep, "changes from the start"),
        (rvl.ramp(0.5, 1.0), "corner at alpha = 0.5:"),
        (lambda a: min(1.0, max(0.0, (a - 0.55) / 0.4)), "corner at alpha = 0.[59]5:"),
        (lambda a: np.sqrt(max(0.0, 2 * a - 1)), "corner at alpha = 0.5:"),
        (lambda a: _smoothstep(max(0.0, 5 * a - 4)), "still rests"),
        (lambda a: np.sin(2.5 * np.pi * max(0.0, 2 * a - 1)) ** 2, "f goes back"),
        (lambda a: _smoothstep(1 / (a - 0.5)), "stopped at \\(0.5\\) with ZeroDivisionError"),
        (lambda a: print("", end=""), "Is a `return` missing"),
        (lambda a: undefined, "NameError"),  # noqa: F821
        (0.5, "a function is asked for"),
    ],
}


def test_a_verdict_is_a_box_that_screen_readers_announce():
    html = checks.one(lambda q: {"<b>": 1}[q])._repr_html_()
    assert 'role="status"' in html
    assert "<b>Not yet.</b>" in html
    assert "TypeError" in html


def _notebook_robots() -> tuple[str, str]:
    """The two MJCF strings of notebook 01."""
    found: dict[str, str] = {}
    for cell in jupytext.read(NOTEBOOK).cells:
        if cell.source.startswith(("GRIPPER =", "HAND =")):
            exec(cell.source, found)
    return found["GRIPPER"], found["HAND"]


def test_the_checks_praise_what_the_package_does_with_the_robots_of_the_notebook():
    gripper, hand = _notebook_robots()
    evolve = rvl.Evolution(gripper, hand)
    model = evolve.model(0)
    assert tuple(model.joint(i).name for i in range(model.njnt)) == checks.JOINTS
    where = lift(read_robot(gripper).compile(), model)
    assert checks.one(lambda q: where.state(np.array(q), np.zeros(2))[0]).right
    rod = 1000 * (np.pi * 0.02**2 * 0.16 + 4 / 3 * np.pi * 0.02**3)

    def pad_and_thumb(alpha: float) -> tuple[float, np.ndarray]:
        robot = evolve.model(alpha)
        return robot.body("finger").mass[0] - rod, robot.body("thumb").quat

    assert checks.two(pad_and_thumb).right
    for f in RIGHT["three"]:
        assert rvl.Evolution(gripper, hand, f=f).model(1).geom("pad").size[0] == checks.RADII[1]
