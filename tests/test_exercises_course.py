"""Exercises of notebooks 02 to 06: right is praised, wrong is told why, nothing ends in a fail."""

import importlib
import math
import re
from pathlib import Path

import numpy as np
import pytest
import torch

from revolver_lab import theory
from revolver_lab.exercises import deterministic_or_randomised as randomised
from revolver_lab.exercises import one_step_of_evolution as step
from revolver_lab.exercises import recognising, verdict
from revolver_lab.exercises import what_h_does as shaping
from revolver_lab.exercises import what_must_be_carried as carried
from revolver_lab.exercises import why_direct_transfer_fails as direct
from revolver_lab.schedule import Schedule
from revolver_lab.shaping import mean_weight, weight

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"
MODULES = (direct, step, randomised, shaping, carried)
NAMES = ("one", "two", "three")


def _loop(alphas, returns):
    for alpha, value in zip(alphas, returns, strict=True):
        if value < returns[0] / 2:
            return alpha
    return None


def _stays(s, xi, k=1):
    return max(0, 1 - k * s / xi) if xi else 0


RIGHT = {
    direct: {
        "one": [lambda a, r: a[np.argmax(r < r[0] / 2)], _loop],
        "two": [lambda p, n: 1 - (1 - p) ** n],
        "three": [lambda q, gamma, k: gamma**k * q],
    },
    step: {
        "one": [
            lambda alpha, xi, rng: rng.uniform(alpha, min(alpha + xi, 1)),
            lambda alpha, xi, rng: alpha + (min(alpha + xi, 1) - alpha) * rng.random(),
            lambda alpha, xi, rng: Schedule(xi=xi).draw(alpha, rng),
        ],
        "two": [(35, 128_800, 8), [35.0, 128800, 8]],
        "three": [
            lambda betas, alpha, xi: betas[(betas >= alpha) & (betas <= alpha + xi)],
            lambda betas, alpha, xi: [b for b in betas if b >= alpha],
        ],
    },
    randomised: {
        "one": [lambda s, xi: _stays(s, xi)],
        "two": [lambda s, xi, n: n * sum(_stays(s, xi, k) for k in range(1, 50))],
        "three": [("unclear", "alike", "better", "unfair")],
    },
    shaping: {
        "one": [
            lambda h, xi: np.log((1 + np.exp(h * xi)) / 2) / h,
            lambda h, xi: theory.phi_v(h, xi),
        ],
        "two": [(0.625, 0.2 / np.e), [0.6249, 0.0736], (0.63, 0.074)],
        "three": [
            lambda b, alpha, xi, h: weight(b, alpha, xi, h, "normalised"),
            lambda b, alpha, xi, h: np.exp(h * b) / mean_weight(alpha, xi, h, "absolute"),
            lambda b, alpha, xi, h: (
                np.exp(h * b) / np.exp(h * np.linspace(alpha, min(alpha + xi, 1), 1001)).mean()
            ),
        ],
    },
    carried: {
        "one": [{"actor", "critics", "target critics"}],
        "two": [
            lambda g, lr: -lr * np.sign(g),
            lambda g, lr: -lr * g / (abs(g) + 1e-8),
        ],
        "three": [0.95, 19 / 20],
    },
}

WRONG = {
    direct: {
        "one": [
            (lambda a, r: int(np.argmax(r < r[0] / 2)), "the place in the array"),
            (lambda a, r: a[np.argmax(r < r.max() / 2)], "You halved the best return"),
            (lambda a, r: a[np.argmax(r < 78)], "fits the first curve"),
            (lambda a, r: a[r >= r[0] / 2][-1], "the last alpha at which the expert is still good"),
            (lambda a, r: a[np.argmax(r < r[0] / 2) - 1], "last alpha before the cliff"),
            (lambda a, r: a[np.flatnonzero(r >= r[0] / 2)[-1] + 1], "the first fall"),
            (lambda a, r: a[r < r[0] / 2][-1], "the last alpha below half"),
            (lambda a, r: a[np.argmin(np.diff(r)) + 1], "drops most"),
            (lambda a, r: r[np.argmax(r < r[0] / 2)], "That is the return there"),
            (lambda a, r: a[np.argmax(r > r[0] / 2)], "ABOVE"),
            (lambda a, r: 0.5, "Halve the first return"),
            (lambda a, r: a[r < r[0] / 2], "one number is needed"),
            (lambda a, r: a[99], "IndexError"),
            (0.2, "a function is asked for"),
        ],
        "two": [
            (lambda p, n: n * p, "Chances do not add up"),
            (lambda p, n: min(1, n * p), "n p cut at 1"),
            (lambda p, n: p**n, "EVERY"),
            (lambda p, n: (1 - p) ** n, "no reward at all"),
            (lambda p, n: 1 - p**n, "not all of them"),
            (lambda p, n: n * p * (1 - p) ** (n - 1), "exactly one"),
            (lambda p, n: p, "one episode's chance"),
            (lambda p, n: p / n, "List the four cases"),
            (lambda p, n: 100 * (1 - (1 - p) ** n), "not in percent"),
            (0.63, "a function is asked for"),
        ],
        "three": [
            (lambda q, g, k: q, "does not stay"),
            (lambda q, g, k: g * q, "one fit"),
            (lambda q, g, k: k * g * q, "do not add up"),
            (lambda q, g, k: q * (1 - g**k), "what was lost"),
            (lambda q, g, k: q - k * (1 - g) * q, "a straight line"),
            (lambda q, g, k: q * (1 - g**k) / (1 - g), "the return of k rewards"),
            (lambda q, g, k: 0, "it takes its time"),
            (lambda q, g, k: q * g ** (k + 1), "One fit too many"),
            (lambda q, g, k: q * (1 - g) ** k, "gamma is what a fit leaves"),
            (lambda q, g, k: q / k, "ZeroDivisionError"),
            (lambda q, g, k: q - k, "after one fit, then after two"),
        ],
    },
    step: {
        "one": [
            (lambda a, xi, rng: rng.uniform(a, a + xi), "no robots beyond alpha = 1"),
            (lambda a, xi, rng: min(rng.uniform(a, a + xi), 1), "drew first and cut then"),
            (lambda a, xi, rng: a, "deterministic variant"),
            (lambda a, xi, rng: rng.uniform(0, xi), "begins at alpha, not at 0"),
            (lambda a, xi, rng: rng.uniform(a, xi), "takes two ends"),
            (lambda a, xi, rng: rng.uniform(a - xi / 2, a + xi / 2), "reaches back"),
            (lambda a, xi, rng: rng.uniform(0, 1), "reaches back"),
            (lambda a, xi, rng: rng.uniform(a, 1), "beyond alpha"),
            (lambda a, xi, rng: rng.uniform(a, min(a + xi / 2, 1)), "quarters"),
            (lambda a, xi, rng: a + (min(a + xi, 1) - a) * rng.beta(2, 2), "quarters"),
            (
                lambda a, xi, rng: np.random.uniform(a, min(a + xi, 1)),  # noqa: NPY002
                "not from `rng`",
            ),
            (lambda a, xi, rng: rng.uniform(a, min(a + xi, 1), 1), "one number is needed"),
            (lambda a, xi: a, "TypeError"),
            (0.25, "a function is asked for"),
        ],
        "two": [
            ((33, 1, 1), "33 steps of 0.03 reach"),
            ((34, 1, 1), "count both ends"),
            ((1 / 0.03, 1, 1), "A third of a phase"),
            ((1 / 0.03 + 1, 1, 1), "A third of a phase"),
            ((50, 1, 1), "List their alphas"),
            ((35, 644, 8), "Those are episodes"),
            ((35, 112_000, 8), "The last phase has 100"),
            ((35, 108_800, 8), "The last phase is missing"),
            ((35, 132_000, 8), "twice"),
            ((35, 128_800 * 8, 8), "share the N_e episodes"),
            ((35, 16_100, 8), "one simulation"),
            ((35, 7, 8), "34 phases have 16"),
            ((35, 128_800, 1), "drawn anew only when an episode ends"),
            ((35, 128_800, 200), "counted in steps"),
            ((35, 128_800, 16), "How far down"),
            ((35, 128_800, 1600), "In episodes"),
            ((35, 128_800, 3), "each needs one"),
            ((35, 128_800), "Give 3 things"),
            (("many", 1, 1), "no number"),
            (lambda: 35, "No function is asked for"),
        ],
        "three": [
            (lambda b, a, xi: b, "Nothing was dropped"),
            (lambda b, a, xi: b[b > a], ">=, not >"),
            (lambda b, a, xi: b[:0], "Nothing stays"),
            (lambda b, a, xi: b[(b >= a) & (b < a + xi)], "Right as long as there is a window"),
            (lambda b, a, xi: b[b < a], "kept what is outdated"),
            (lambda b, a, xi: b[b <= a], "kept what is outdated"),
            (lambda b, a, xi: b[abs(b - a) <= xi], "alpha - xi"),
            (lambda b, a, xi: b[b >= a - xi], "alpha - xi"),
            (lambda b, a, xi: b[(b >= a) & (b <= xi)], "not at xi"),
            (lambda b, a, xi: np.flatnonzero(b >= a), "places in the array"),
            (lambda b, a, xi: np.sort(b[b >= a]), "another order"),
            (lambda b, a, xi: b >= a, "A condition alone"),
            (lambda b, a, xi: list(b >= a), "A condition alone"),
            (lambda b, a, xi: len(b), "Return the betas"),
            (lambda b, a, xi: b[:3], "Which of them lie"),
            (lambda b, a, xi: ["x"], "no number"),
        ],
    },
    randomised: {
        "one": [
            (lambda s, xi: s / xi if xi else 1, "the fraction that is dropped"),
            (lambda s, xi: max(xi - s, 0), "the length"),
            (lambda s, xi: 1 - s, "leaves out how wide"),
            (lambda s, xi: _stays(s, xi) if xi else 1, "nothing stays"),
            (lambda s, xi: float(xi > 0), "Some of the window"),
            (lambda s, xi: _stays(s, xi) / 2, "Why half"),
            (lambda s, xi: (xi - s) / (xi + s), "from the old one alone"),
            (lambda s, xi: 1 - s / xi, "Right where xi > 0.*ZeroDivisionError"),
            (lambda s, xi: s / xi, "the fraction that is dropped"),
            (lambda s, xi: 100 * _stays(s, xi), "not in percent"),
            (lambda s, xi: 0.5, "Draw the two"),
            (2 / 3, "a function is asked for"),
        ],
        "two": [
            (lambda s, xi, n: n * _stays(s, xi), "the last phase left"),
            (lambda s, xi, n: n * sum(_stays(s, xi) ** k for k in range(1, 999)),
             "no longer spread"),
            (lambda s, xi, n: n * sum(_stays(s, xi, k) for k in range(1, 50)) + n,
             "counted the new phase"),
            (lambda s, xi, n: n * (1 + sum(_stays(s, xi, k) for k in range(1, 50))) if xi else 0,
             "counted the new phase"),
            (lambda s, xi, n: n * xi / s, "every phase whole"),
            (lambda s, xi, n: n * xi / s / 2, "A good guess"),
            (lambda s, xi, n: n * sum(_stays(s, xi, k) for k in range(1, 50)) if xi else n,
             "With xi = 0 nothing stays"),
            (lambda s, xi, n: n, "fits the first case by chance"),
            (lambda s, xi, n: sum(_stays(s, xi, k) for k in range(1, 50)), "multiply by n"),
            (lambda s, xi, n: n * (xi / s - 1) / 2 if xi else 0, "the sum ends sooner"),
            (lambda s, xi, n: 12, "add that up"),
        ],
        "three": [
            (("better", "alike", "better", "unfair"), r"\(a\) The interval holds 0"),
            (("alike", "alike", "better", "unfair"), r"\(a\) Not seeing a difference"),
            (("unclear", "unclear", "better", "unfair"), r"\(b\) This interval says a lot"),
            (("unclear", "worse", "better", "unfair"), r"\(b\) .*do not matter"),
            (("unclear", "alike", "unclear", "unfair"), r"\(c\) The whole interval"),
            (("unclear", "alike", "worse", "unfair"), r"\(c\) The difference is"),
            (("unclear", "alike", "better", "better"), r"\(d\) .*starvation"),
            (("unclear", "alike", "better", "unclear"), r"\(d\) More seeds"),
            (("unclear", "alike", "better", "robust"), "none of the words"),
            (("unclear", "alike", "better", 3), "none of the words"),
            (("unclear", "alike"), "Give 4 things"),
        ],
    },
    shaping: {
        "one": [
            (lambda h, xi: theory.phi_quadratic(h, xi), "weighted mean"),
            (lambda h, xi: xi / (1 + np.exp(-h * xi)), "vary phi, not beta"),
            (lambda h, xi: xi / 2 + h * xi**2 / 4, "the paper's theorem"),
            (lambda h, xi: xi / 2 + h * xi**2 / 8, "Right to second order"),
            (lambda h, xi: xi / 2 + h * xi**2 / 12, "series of the weighted mean"),
            (lambda h, xi: xi / 2, "the middle of the window"),
            (lambda h, xi: -np.log((1 + np.exp(-h * xi)) / 2) / h, "away from the target"),
            (lambda h, xi: np.log((1 + np.exp(h * xi)) / 2) / h - xi / 2, "That is the shift"),
            (lambda h, xi: np.log((1 + np.exp(h * xi)) / 2), "one division is left"),
            (lambda h, xi: xi, "the end of the window"),
            (lambda h, xi: h, "Solve"),
        ],
        "two": [
            ((1.25, 0), "the paper's 1/4"),
            ((0.41667, 0), "1/12"),
            ((0.00125, 0), "How many steps"),
            ((25.625, 0), "MOVE"),
            ((50, 0), "the window in steps"),
            ((25, 0), "without h"),
            ((6.25, 0), "xi counts squared"),
            ((3, 0), "divide it by l_k"),
            ((0.625, 0.2 * np.e), "The other way round"),
            ((0.625, 0.2), "was not changed"),
            ((0.625, np.e), "factor of the reward"),
            ((0.625, 1 / np.e), "ratio"),
            ((0.625, 0.2 * np.exp(-0.1)), "not xi"),
            ((0.625, -0.8), "not taken away"),
            ((0.625, 7), "Divide r exp"),
            (0.625, "Give 2 things"),
        ],
        "three": [
            (lambda b, a, xi, h: np.exp(h * b), "the paper's form"),
            (lambda b, a, xi, h: np.exp(h * (b - a)), "still above 1"),
            (lambda b, a, xi, h: np.exp(h * b) / np.exp(h * b).mean(), "mean of the batch"),
            (lambda b, a, xi, h: np.exp(h * b) / np.exp(h * b).sum(), "add up to 1"),
            (lambda b, a, xi, h: np.exp(h * b) / np.exp(h * b).max(), "largest weight is 1"),
            (
                lambda b, a, xi, h: np.exp(h * (b - (a + min(a + xi, 1)) / 2)),
                "above exp of the mean",
            ),
            (lambda b, a, xi, h: weight(b, 0, 1, h, "relative") * h * xi
             / (np.exp(h * a) * np.expm1(h * xi)), "Right until the window meets"),
            (lambda b, a, xi, h: h * np.exp(h * (b - a)) / np.expm1(h * (min(a + xi, 1) - a)),
             "the integral over the width"),
            (lambda b, a, xi, h: np.ones_like(b), "the shift is gone"),
            (lambda b, a, xi, h: b, "an integral over"),
            (lambda b, a, xi, h: 1.0, "one for each beta"),
            (lambda b, a, xi, h: b[:2], "4 numbers are needed"),
        ],
    },
    carried: {
        "one": [
            (set(), "actor is missing"),
            ({"actor"}, "critics is missing"),
            ({"actor", "critics"}, "target critics is missing"),
            (set(carried.PARTS), "replay is too many"),
            (["actor", "critics", "target critics", "moments"], "moments is too many"),
            ({"actor", "Q"}, "none of the names"),
            ("actor", "Give a set"),
        ],
        "two": [
            (lambda g, lr: -lr * g, "plain gradient descent"),
            (lambda g, lr: -lr * 0.1 * g / np.sqrt(0.001 * g**2), "bias correction is missing"),
            (lambda g, lr: -lr * 0.1 * g / abs(g), "m = 0.1 g was not corrected"),
            (lambda g, lr: -lr * g / np.sqrt(0.001 * g**2), "v = 0.001"),
            (lambda g, lr: -lr * 0.1 * g, "stepped along m"),
            (lambda g, lr: lr * np.sign(g), "uphill: Adam"),
            (lambda g, lr: lr * g, "uphill, and"),
            (lambda g, lr: lr, "which way"),
            (lambda g, lr: -lr, "so is the sign"),
            (lambda g, lr: -lr * g / g**2, "a root is missing"),
            (lambda g, lr: 0, "do not stay so"),
            (lambda g, lr: -np.sign(g), "learning rate is missing"),
            (lambda g, lr: g, "divided by its correction"),
        ],
        "three": [
            (0.05, "still of use"),
            (0.9, "whole window"),
            (0.85, "since alpha - xi"),
            (1, "beyond 0.8 already"),
            (0.8, "That is alpha"),
            (0.68, "a place on the path"),
            (0.88, r"spread over \[0, 1\]"),
            (19 / 21, "21st phase"),
            (20 / 21, "21st phase"),
            (19, "As a fraction"),
            (95, "not in per cent"),
            (0.3, "Take the mean"),
            (lambda: 0.95, "No function is asked for"),
            ("most", "no number"),
        ],
    },
}  # fmt: skip


def test_the_exercises_that_notebooks_name_exist():
    for path in NOTEBOOKS.glob("*.py"):
        text = path.read_text()
        for module, nick in re.findall(r"from revolver_lab\.exercises import (\w+) as (\w+)", text):
            checks = importlib.import_module(f"revolver_lab.exercises.{module}")
            used = re.findall(rf"\b{nick}\.(\w+)\(", text)
            assert used, path
            assert all(callable(getattr(checks, name, None)) for name in used), path
            assert module == path.stem[3:], path


def test_the_answers_about_a_run_are_those_of_the_schedule():
    schedule = Schedule(
        alpha_step=step.ALPHA_STEP, episodes_per_phase=step.EPISODES,
        final_episodes=step.FINAL_EPISODES,
    )  # fmt: skip
    phases = len(schedule.alphas)
    episodes = sum(map(schedule.episodes, schedule.alphas))
    assert step.two((phases, episodes * step.EPISODE_STEPS, step.SIMULATIONS)).right


def _simulated(step_size, xi, phases):
    """Betas of a replay that is never cleaned, 20,000 a phase, evenly spread; and alpha."""
    even = (np.arange(20_000) + 0.5) / 20_000
    betas = [k * step_size + xi * even for k in range(phases)]
    return np.concatenate(betas), phases * step_size


def test_the_answers_about_a_replay_are_what_a_replay_holds():
    betas, alpha = _simulated(0.04, 0.12, 20)
    assert carried.three(float((betas < alpha - 1e-12).mean())).right

    def held(step_size, xi, count):
        betas, alpha = _simulated(step_size, xi, 60)
        return (betas >= alpha - 1e-12).sum() * count / 20_000

    assert randomised.two(held).right
    even = (np.arange(20_000) + 0.5) / 20_000
    assert randomised.one(lambda s, xi: (xi * even >= s).mean()).right


def test_the_answer_about_adam_is_torchs():
    def first_step(gradient: float, lr: float) -> float:
        weight = torch.zeros(1, requires_grad=True)
        weight.grad = torch.tensor([gradient])
        torch.optim.Adam([weight], lr=lr).step()
        return weight.item()

    assert carried.two(first_step).right


def test_the_answers_about_h_are_found_without_formulas():
    assert shaping.one(lambda h, xi: theory.best_phi(h, xi)).right
    steps = (theory.best_phi(1, 0.1) - theory.best_phi(0, 0.1)) / shaping.ALPHA_STEP
    assert shaping.two((steps, 0.2 / math.e)).right

    def weights(betas, alpha, xi, h):
        grid = np.linspace(alpha, min(alpha + xi, 1), 200_001)
        return np.exp(h * betas) / np.trapezoid(np.exp(h * grid), grid) * np.ptp(grid)

    assert shaping.three(weights).right


def test_a_part_that_is_missing_or_unlike_a_number_is_named():
    with pytest.raises(verdict.NotYet, match="alpha, beta"):
        recognising.parts((1, 2, 3), ("alpha", "beta"))
    with pytest.raises(verdict.NotYet, match="no number"):
        recognising.values(lambda x: "x", [(1,)], "The chance")
