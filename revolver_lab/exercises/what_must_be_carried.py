"""Checks of notebook 06: what travels, what fresh moments do, and what a replay gathers."""

from typing import Any

import numpy as np

from revolver_lab.exercises.recognising import over, recognise, values
from revolver_lab.exercises.verdict import NotYet, Verdict, judge, numbers

TEXTS = {
    "one": "A transfer with SAC begins. Name, in a set, what it takes over from the expert: "
    "'actor', 'critics', 'target critics', 'replay', 'moments' (Adam's).",
    "two": "Adam begins with moments of zero (beta_1 = 0.9, beta_2 = 0.999, epsilon can be left "
    "out). Write a function of a gradient g and the learning rate lr: by how much does the very "
    "first step change the weight?",
    "three": "No cleaning: xi = 0.12, l = 0.04, every phase brings the same number of transitions, "
    "and the phase at alpha = 0.8 begins, the 21st. Which fraction of the replay has beta < "
    "alpha?",
}
"""What each exercise asks."""

PARTS = ("actor", "critics", "target critics", "replay", "moments")
_CARRIED = {"actor", "critics", "target critics"}
_STEPS = ((0.01, 1e-3), (-40.0, 1e-3), (3.0, 3e-4))
_MISSING = {
    "actor": "Without the actor nothing is transferred: it is what acts.",
    "critics": "A new critic knows nothing, and from the first update on the actor follows it. "
    "The expert's critic, which knows why the actor acts so, comes along.",
    "target critics": "The critics are fitted to what their targets say. A target that starts at "
    "random pulls them there, and goes only tau = 1 % of the way with each update.",
}
_TOO_MUCH = {
    "replay": "The replay starts empty (line 10 of Algorithm 1). What the expert saw while it "
    "learnt comes from poorer policies, and would be dropped with the first cleaning anyway.",
    "moments": "Adam's moments belong to the expert's last gradients. They are cheap to gather "
    "anew, and a policy file does not hold them: every transfer begins with fresh ones.",
}


def one(answer: Any) -> Verdict:
    """Exercise 1: what a transfer takes over.

    Args:
        answer: A set of some of `PARTS`.
    """
    return judge(
        answer,
        _carried_mistake,
        "Actor and critics are one piece of knowledge: what to do, and why. The rest is gathered "
        "on the way.",
    )


def _carried_mistake(answer: Any) -> None:
    """Something missing, something too many, or an unknown name."""
    if isinstance(answer, str) or not isinstance(answer, set | frozenset | list | tuple):
        raise NotYet("Give a set of names, such as {'actor', 'replay'}.")
    for name in answer:
        if not isinstance(name, str) or name not in PARTS:
            raise NotYet(f"{name!r} is none of the names {', '.join(map(repr, PARTS))}.")
    for name, message in _MISSING.items():
        if name not in answer:
            raise NotYet(f"{name} is missing. {message}")
    for name, message in _TOO_MUCH.items():
        if name in answer:
            raise NotYet(f"{name} is too many. {message}")


def two(answer: Any) -> Verdict:
    """Exercise 2: Adam's first step.

    Args:
        answer: Function of the gradient and the learning rate, of the change of the weight.
    """
    return judge(
        answer,
        _adam_mistake,
        "-lr times the sign of g: the first step is as large as any, however small the gradient "
        "and however good the weights were. Fresh moments at every phase would take such a step "
        "in every weight, every time.",
    )


def _adam_mistake(answer: Any) -> None:
    """Another optimiser, no bias correction, or uphill."""
    found = values(answer, _STEPS, "The change")
    known = [
        (over(_STEPS, lambda g, lr: -lr * g), "That is plain gradient descent. Adam divides by the "
         "root of the second moment: g / sqrt(g^2)."),
        (over(_STEPS, lambda g, lr: -lr * 0.1 * np.sign(g) / np.sqrt(0.001)), "The bias correction "
         "is missing. m = 0.1 g and v = 0.001 g^2 are far too small after one step, and are "
         "divided by 1 - 0.9 and 1 - 0.999. Without that the first step is three times too large."),
        (over(_STEPS, lambda g, lr: -lr * 0.1 * np.sign(g)), "m = 0.1 g was not corrected: divide "
         "it by 1 - 0.9."),
        (over(_STEPS, lambda g, lr: -lr * np.sign(g) / np.sqrt(0.001)), "v = 0.001 g^2 was not "
         "corrected: divide it by 1 - 0.999."),
        (over(_STEPS, lambda g, lr: -lr * 0.1 * g), "You stepped along m = 0.1 g. It still has to "
         "be corrected, and divided by the root of v."),
        (over(_STEPS, lambda g, lr: lr * np.sign(g)), "That goes uphill: Adam subtracts its step."),
        (over(_STEPS, lambda g, lr: lr * g), "That goes uphill, and it is gradient descent."),
        (over(_STEPS, lambda g, lr: lr), "The size is right. But which way? It depends on g."),
        (over(_STEPS, lambda g, lr: -lr), "The size is right, and so is the sign where g > 0."),
        (over(_STEPS, lambda g, lr: -lr / g), "g / v is not g / sqrt(v): a root is missing."),
        (over(_STEPS, lambda g, lr: 0.0), "Moments of zero do not stay so: they are updated with g "
         "before the step."),
        (over(_STEPS, lambda g, lr: -np.sign(g)), "The learning rate is missing."),
    ]  # fmt: skip
    recognise(found, over(_STEPS, lambda g, lr: -lr * np.sign(g)), known,
              f"For g = 3 and lr = 0.0003 you say {found[2]:.4g}. m = (1 - 0.9) g, divided by its "
              "correction 1 - 0.9; v likewise; then -lr m / sqrt(v).", near=1e-3)  # fmt: skip


def three(answer: Any) -> Verdict:
    """Exercise 3: the outdated fraction of a replay that is never cleaned.

    Args:
        answer: One number.
    """
    return judge(
        answer,
        _outdated_mistake,
        "19 of 20: of a hundred transitions in a batch, five are of robots that may still be met. "
        "The rest is from legs of the past, and its share grows from phase to phase.",
    )


def _outdated_mistake(answer: Any) -> None:
    """Counted the fresh, phases instead of transitions, or took alpha for a fraction."""
    if callable(answer):
        raise NotYet("No function is asked for, but one number between 0 and 1.")
    found = float(numbers(answer, None, "The fraction"))
    recognise(found, 19 / 20, [
        (1 / 20, "That is the fraction that is still of use. Asked for is the rest."),
        (18 / 20, "You counted phases whose whole window lies behind alpha. Of the last two phases "
         "a part lies behind it as well: 1/3 and 2/3."),
        (17 / 20, "You took everything since alpha - xi = 0.68 for fresh. But of the last three "
         "windows a part lies behind 0.8, of the earliest all."),
        (1.0, "The last two phases drew some betas beyond 0.8 already."),
        (0.8, "That is alpha, a place on the path. Count, phase by phase, which part of its window "
         "lies behind 0.8."),
        (0.68, "alpha - xi is a place on the path, not a fraction of the replay."),
        (0.88, "1 - xi would be it for betas spread over [0, 1]. They were not: look at where each "
         "phase drew from."),
        (19 / 21, "The 21st phase has brought nothing yet: 20 phases are in the replay."),
        (20 / 21, "The 21st phase has brought nothing yet, and of the last two some is fresh."),
        (19.0, "Those are phases, of 20. As a fraction?"),
        (95.0, "As a fraction, not in per cent."),
    ], f"{found:.4g}? The phase k steps back drew from a window of which the part min(1, k l / xi) "
        "lies behind alpha. Take the mean over the 20 phases.", near=1e-3)  # fmt: skip
