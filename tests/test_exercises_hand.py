"""Exercises of notebook 08: right is praised, wrong is told why, and answers are the code's."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from revolver_lab.exercises import five_fingers_to_two as hand
from revolver_lab.gates import Position, SampledGate
from revolver_lab.learners.natural import gaussian
from revolver_lab.learners.natural.steps import natural_step

NOTEBOOK = Path(__file__).parent.parent / "notebooks" / "08_five_fingers_to_two.py"


def _trust(m, s):
    return (min(m, s + 0.1) - 0.4) / 0.4


def _bounded(m, s):
    return min(max(_trust(m, s), 0), 1)


RIGHT = {
    "one": [
        lambda n: 1 - 0.05 ** (1 / n),
        lambda n: brentq(lambda p: (1 - p) ** n - 0.05, 1e-9, 1 - 1e-9, xtol=1e-12),
    ],
    "two": [
        lambda g, sigma, delta: np.sqrt(delta) * sigma * np.sign(g),
        lambda g, sigma, delta: np.sqrt(delta / (g * sigma**2 * g)) * sigma**2 * g,
    ],
    "three": [
        lambda alpha, m, s: min(alpha + 0.03 * _bounded(m, s), 1),
        lambda alpha, m, s: np.clip(alpha + 0.03 * np.interp(min(m, s + 0.1), [0.4, 0.8], [0, 1]),
                                    0, 1),
    ],
}  # fmt: skip

WRONG = {
    "one": [
        (lambda n: 0, "best guess"),
        (lambda n: 1 / n, "one reward is expected"),
        (lambda n: 3 / n, "rule of three"),
        (lambda n: 0.05 / n, "nearly certain"),
        (lambda n: 1 - 0.95 ** (1 / n), "probability of 95 %"),
        (lambda n: 0.05 ** (1 / n), "That is 1 - p"),
        (lambda n: 0.95**n, "chance of none"),
        (lambda n: 1 - 0.95**n, "at least one"),
        (lambda n: 1 - 0.025 ** (1 / n), "two"),
        (lambda n: -np.log(0.05) / n, "not quite -p"),
        (lambda n: 1 / (n + 2), "Laplace"),
        (lambda n: 0.05, "which is given"),
        (lambda n: n, "All ten fail"),
        (lambda n: 100 * (1 - 0.05 ** (1 / n)), "not in percent"),
        (0.05, "a function is asked for"),
    ],
    "two": [
        (lambda g, s, d: d * g, "plain gradient ascent"),
        (lambda g, s, d: s**2 * g, "length is still to be set"),
        (lambda g, s, d: d * s**2 * g, "no learning rate"),
        (lambda g, s, d: np.sqrt(d) * s**2 * g, "root of g x as well"),
        (lambda g, s, d: np.sqrt(d) * g / abs(g), "in theta"),
        (lambda g, s, d: np.sqrt(d) * g / abs(g) / s, "You took F = sigma"),
        (lambda g, s, d: np.sqrt(d) * s, "which way"),
        (lambda g, s, d: -np.sqrt(d) * s * np.sign(g), "downhill"),
        (lambda g, s, d: np.sqrt(2 * d) * s * np.sign(g), "convention"),
        (lambda g, s, d: np.sqrt(d / 2) * s * np.sign(g), "delta / 4"),
        (lambda g, s, d: d * s * np.sign(g), "A root is missing"),
        (lambda g, s, d: np.sqrt(d) * s**2 * np.sign(g), "one sigma falls out"),
        (lambda g, s, d: np.sqrt(d / (g * s**2 * g)), "That is the factor"),
        (lambda g, s, d: g, "x = F"),
        (0.1, "a function is asked for"),
    ],
    "three": [
        (lambda a, m, s: a + 0.03 * _trust(m, s), "Nothing is clipped"),
        (lambda a, m, s: min(a + 0.03 * _trust(m, s), 1), r"not clipped to \[0, 1\]"),
        (lambda a, m, s: min(a + 0.03 * max(_trust(m, s), 0), 1), "the largest step"),
        (lambda a, m, s: min(a + 0.03 * min(_trust(m, s), 1), 1), "you go back"),
        (lambda a, m, s: a + 0.03 * _bounded(m, s), "no robot beyond"),
        (lambda a, m, s: min(a + 0.03 * _bounded(m, 1), 1), "average alone"),
        (lambda a, m, s: min(a + 0.03 * _bounded(s, s), 1), "last batch alone"),
        (lambda a, m, s: min(a + 0.03 * _bounded(min(m, s), s), 1), "slack is missing"),
        (lambda a, m, s: min(a + 0.03 * _bounded(max(m, s + 0.1), 9), 1), "larger of"),
        (lambda a, m, s: min(a + 0.03 * (min(m, s + 0.1) > 0.4), 1), "in proportion"),
        (lambda a, m, s: min(a + 0.03 * (min(m, s + 0.1) >= 0.8), 1), "in proportion"),
        (lambda a, m, s: min(a + 0.03 * min(max(_trust(m, s) / 2, 0), 1), 1), "divided by 0.8"),
        (lambda a, m, s: min(0.03 * _bounded(m, s), 1 - a), "That is the step"),
        (lambda a, m, s: min(a + 0.03, 1), "a schedule, and no gate"),
        (lambda a, m, s: a, "half of l"),
        (0.03, "a function is asked for"),
    ],
}


def test_the_answer_about_none_is_what_happens():
    rng, bound = np.random.default_rng(0), RIGHT["one"][0]
    for n in (10, 220):
        none = (rng.random((20_000, n)) >= bound(n)).all(axis=1).mean()
        assert none == pytest.approx(0.05, abs=0.005)


def test_the_answer_about_the_step_is_the_learners_and_its_divergence_is_half_of_delta():
    def step(gradient: float, sigma: float, delta: float) -> float:
        g = np.array([gradient])
        moved = natural_step(g, sigma**2 * g, delta)
        spread = np.log([sigma])
        apart = gaussian.kl(np.zeros((1, 1)), spread, moved[None], spread)
        assert float(apart.mean()) == pytest.approx(delta / 2)
        return float(moved[0])

    assert hand.two(step).right


def test_the_answer_about_the_gate_is_the_gates():
    gate = SampledGate()

    def onward(alpha: float, average: float, success: float) -> float:
        before = (average - gate.weight * success) / (1 - gate.weight)
        place = Position(alpha=alpha, average=before)
        return gate.after(place, success, lambda *_: 0.0).alpha

    assert hand.three(onward).right
