"""Checks of notebook 04: what cleaning leaves of the data, and what an interval allows to say."""

from typing import Any

import numpy as np

from revolver_lab.exercises.recognising import over, parts, recognise, values
from revolver_lab.exercises.verdict import NotYet, Verdict, judge

TEXTS = {
    "one": "A phase is over, alpha grows by l (alpha_step), and the replay is cleaned. The betas "
    "of the phase were drawn from [alpha, alpha + xi]. Write a function of l and xi: which "
    "fraction of that phase's transitions stays, on average? xi = 0 is the deterministic variant.",
    "two": "And all earlier phases? Each brought n transitions, and there were many of them. Write "
    "a function of l, xi and n: how many transitions does the replay hold at the beginning of a "
    "phase, right after cleaning?",
    "three": "Before the experiment we agreed that a difference of less than 10 points does not "
    "matter. Here are four made-up 95 % intervals of the difference, randomised - deterministic. "
    "Give four words, each 'better' (randomised is), 'worse', 'alike' (the difference does not "
    "matter), 'unclear' (more seeds are needed) or 'unfair' (the comparison cannot show it). "
    "(a) 4 seeds, +32, from -9 to +71. (b) 20 seeds, -2, from -6 to +3. (c) 20 seeds, +22, from "
    "+13 to +31, with equal data in the replay. (d) 20 seeds, +40, from +25 to +55; after each "
    "cleaning the randomised learner kept 1,600 transitions and the deterministic one none. Does "
    "it show that random robots make a policy robust?",
}
"""What each exercise asks."""

WORDS = ("better", "worse", "alike", "unclear", "unfair")
_CLEANINGS = ((0.04, 0.12), (0.02, 0.1), (0.01, 0.08))
_STILL = (0.04, 0.0)
_PHASES = ((0.04, 0.12, 1600), (0.04, 0.0, 1600), (0.02, 0.1, 100), (0.05, 0.08, 1000))


def one(answer: Any) -> Verdict:
    """Exercise 1: the fraction of a phase's transitions that one cleaning leaves.

    Args:
        answer: Function of alpha_step and xi.
    """
    return judge(
        answer,
        _fraction_mistake,
        "Two thirds in the course's randomised variant, and nothing in the deterministic one. The "
        "two differ in their data before they differ in their robots.",
    )


def _fraction_mistake(answer: Any) -> None:
    """The dropped fraction, a length, or a deterministic variant that keeps something."""
    found = values(answer, _CLEANINGS, "The fraction")
    right = over(_CLEANINGS, _stays)
    known = [
        (over(_CLEANINGS, lambda step, xi: step / xi), "That is the fraction that is dropped: the "
         "part of the window that alpha passes."),
        (100 * right, "As a fraction, not in percent."),
        (over(_CLEANINGS, lambda step, xi: max(xi - step, 0.0)), "That is the length of what the "
         "old and the new window share. Which fraction of the old one is it?"),
        (over(_CLEANINGS, lambda step, xi: 1 - step), "1 - l leaves out how wide the window is: "
         "beta was drawn from xi, not from [0, 1]."),
        (np.ones(len(right)), "Some of the window is passed by alpha, for l > 0."),
        (right / 2, "Why half of it? beta is uniform on its window."),
        (over(_CLEANINGS, lambda step, xi: (xi - step) / (xi + step)), "The windows together are "
         "xi + l wide, but the transitions come from the old one alone."),
    ]  # fmt: skip
    recognise(found, right, known, f"For l = 0.04, xi = 0.12 you say {found[0]:.4g}. Draw the two "
              "windows, [0, 0.12] and [0.04, 0.16], over each other.")  # fmt: skip
    moved_on = "Right where xi > 0. With xi = 0 every beta is alpha itself, and alpha moves on: "
    try:
        still = values(answer, [_STILL], "The fraction")
    except NotYet as mistake:
        raise NotYet(f"{moved_on}nothing stays. {mistake}") from None
    if still.any():
        raise NotYet(f"{moved_on}nothing stays, where you say {still[0]:.4g}.")


def _stays(step: float, xi: float, cleanings: int = 1) -> float:
    """The fraction of a phase that is left after some cleanings."""
    return max(0.0, 1 - cleanings * step / xi) if xi else 0.0


def _held(step: float, xi: float, count: int) -> float:
    """What is held of all earlier phases together."""
    return count * sum(_stays(step, xi, k) for k in range(1, 200))


def two(answer: Any) -> Verdict:
    """Exercise 2: how many transitions the replay holds at the beginning of a phase.

    Args:
        answer: Function of alpha_step, xi and the transitions of a phase.
    """
    return judge(
        answer,
        _held_mistake,
        "In the course, 1,600 against 0: each phase of the deterministic variant begins with "
        "nothing. An ablation of randomness must hold this equal, for example by keeping the "
        "latest 1,600 of either.",
    )


def _held_mistake(answer: Any) -> None:
    """Phases forgotten, counted whole, or thinned by the same factor again and again."""
    found = values(answer, _PHASES, "The number of transitions")

    def thinned(step: float, xi: float, count: int) -> float:
        left = _stays(step, xi)
        return count * left / (1 - left)

    known = [
        (over(_PHASES, lambda step, xi, n: n * _stays(step, xi)), "That is what the last phase "
         "left. The one before it has met two cleanings, and something of it may be left too."),
        (over(_PHASES, thinned), "You multiplied the fractions, as if each cleaning took its share "
         "of what is left. But what is left is no longer spread over the whole window: its lower "
         "part is gone. After k cleanings 1 - k l / xi stays."),
        *((over(_PHASES, lambda step, xi, n, of=of: _held(step, xi, n) + n * (xi > 0 or of)), "You "
           "counted the new phase, which has brought nothing yet.") for of in (False, True)),
        (over(_PHASES, lambda step, xi, n: n * (xi / step)), "You counted every phase whole whose "
         "window is still touched. Only its upper part stays."),
        (over(_PHASES, lambda step, xi, n: n * (xi / step) / 2), "A good guess: half of the xi / l "
         "phases. But it counts the triangle as if it were smooth; add up the steps: 1 - l / xi, "
         "1 - 2 l / xi, ..."),
        (over(_PHASES, lambda step, xi, n: _held(step, xi, n) if xi else n), "With xi = 0 nothing "
         "stays."),
        (over(_PHASES, lambda step, xi, n: n), "That fits the first case by chance. Look at "
         "xi = 0."),
        (over(_PHASES, lambda step, xi, n: _held(step, xi, n) / n), "That is in phases; multiply "
         "by n."),
        (over(_PHASES, lambda step, xi, n: n * (xi / step - 1) / 2 if xi else 0), "Right where xi "
         "is a multiple of l. Where it is not, as for l = 0.05 and xi = 0.08, the sum ends sooner: "
         "max(0, 1 - k l / xi)."),
    ]  # fmt: skip
    recognise(found, over(_PHASES, _held), known, f"For l = 0.04, xi = 0.12 and n = 1600 you say "
              f"{found[0]:.5g}. After k cleanings a phase has 1 - k l / xi left, never less than "
              "0; add that up over k = 1, 2, ...")  # fmt: skip


def three(answer: Any) -> Verdict:
    """Exercise 3: what four intervals allow to say.

    Args:
        answer: Four of `WORDS`.
    """
    return judge(
        answer,
        _reading_mistake,
        "An interval that holds 0 is no proof that nothing is there; a narrow one near 0 nearly "
        "is; and no number of seeds mends a comparison in which two things were changed.",
    )


_READINGS = (
    ("unclear", {
        "better": "(a) The interval holds 0, and even -9: four seeds cannot tell +32 from luck.",
        "alike": "(a) Not seeing a difference is not seeing that there is none: +71 is as possible "
        "as -9.",
        "worse": "(a) Most of the interval is above 0.",
        "unfair": "(a) Nothing is wrong with the comparison; there is too little of it.",
    }),
    ("alike", {
        "unclear": "(b) This interval says a lot: whatever the difference is, it is less than the "
        "10 points that matter. More seeds would not change what to do.",
        "better": "(b) The interval holds 0 and its middle is below 0.",
        "worse": "(b) The interval holds 0; and 6 points, we agreed, do not matter.",
        "unfair": "(b) Nothing is wrong with the comparison.",
    }),
    ("better", {
        "unclear": "(c) The whole interval is above 0, and above the 10 points that matter.",
        "alike": "(c) The whole interval is above the 10 points that matter.",
        "worse": "(c) The difference is randomised minus deterministic, and positive.",
        "unfair": "(c) Data was held equal, so that only the robots differ.",
    }),
    ("unfair", {
        "better": "(d) The number is beyond doubt, its reason is not: one learner had data and the "
        "other had none. Robustness and starvation are mixed up.",
        "unclear": "(d) More seeds make the interval narrower, not the comparison cleaner: data "
        "and robots were changed together.",
        "alike": "(d) They differ by 40 points. But why?",
        "worse": "(d) The difference is randomised minus deterministic, and positive. But why?",
    }),
)  # fmt: skip


def _reading_mistake(answer: Any) -> None:
    """The first case that is read wrongly."""
    given = parts(answer, ("a", "b", "c", "d"))
    for case, word, (right, messages) in zip("abcd", given, _READINGS, strict=True):
        if not isinstance(word, str) or word not in WORDS:
            raise NotYet(f"({case}) {word!r} is none of the words {', '.join(WORDS)}.")
        if word != right:
            raise NotYet(messages[word])
