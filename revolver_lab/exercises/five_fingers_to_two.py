"""Checks of notebook 08: what none in n says, how far a natural step goes, and the gate."""

from typing import Any

import numpy as np

from revolver_lab.exercises.recognising import over, recognise, values
from revolver_lab.exercises.verdict import Verdict, judge

TEXTS = {
    "one": "None of n episodes was rewarded. Write a function of n: the largest chance p of a "
    "rewarded episode under which seeing none of them still has a probability of 5 %.",
    "two": "One action, a ~ N(theta, sigma^2), sigma known. The gradient of what is to be "
    "maximised with respect to theta is g. Write a function of g, sigma and delta: by how much "
    "does the natural step change theta?",
    "three": "The moving average of the success is m, the last batch's success s, alpha is where "
    "it is; l = 0.03, and the gate is fully open from a success of 0.8 on and closed up to 0.4. "
    "The average counts for no more than s + 0.1. Write a function of alpha, m and s: the next "
    "alpha.",
}
"""What each exercise asks."""

_COUNTS = ((1,), (10,), (220,), (9728,))
_STEPS = ((0.3, 0.5, 0.05), (-40.0, 0.5, 0.05), (1e-4, 2.0, 0.02))
_PLACES = ((0.2, 0.6, 0.6), (0.2, 0.5, 0.7), (0.2, 0.9, 0.95), (0.2, 0.3, 0.35), (0.2, 0.8, 0.5),
           (0.99, 0.9, 0.9))  # fmt: skip


def one(answer: Any) -> Verdict:
    """Exercise 1: the upper end of an interval around none.

    Args:
        answer: Function of the number of episodes, of the largest chance.
    """
    return judge(
        answer,
        _none_mistake,
        "About 3 / n where n is large: none of 64 still allows one in 22, none of 9,728 allows one "
        "in 3,250. 'Never' is always a number of episodes.",
    )


def _none_mistake(answer: Any) -> None:
    """Chances that do not come from the probability of none."""
    found = values(answer, _COUNTS, "The chance")
    known = [
        (over(_COUNTS, lambda n: 0.0), "0 is the best guess, but others would have given the same "
         "zeros. How large can p be, if (1 - p)^n is still 0.05?"),
        (over(_COUNTS, lambda n: 1 / n), "1 / n is the p at which one reward is expected, and none "
         "is seen in a third of all cases. Solve (1 - p)^n = 0.05."),
        (over(_COUNTS, lambda n: 3 / n), "That is the rule of three, and a good one for large n. "
         "For n = 1 it says 3. Where does it come from?"),
        (over(_COUNTS, lambda n: 0.05 / n), "At that p seeing none is nearly certain, not rare. "
         "Solve (1 - p)^n = 0.05 for p."),
        (over(_COUNTS, lambda n: 1 - 0.95 ** (1 / n)), "That is the p at which none has a "
         "probability of 95 %. Asked for is 5 %."),
        (over(_COUNTS, lambda n: 0.05 ** (1 / n)), "That is 1 - p, the chance of no reward in one "
         "episode."),
        (over(_COUNTS, lambda n: 0.95**n), "That is the chance of none where p is 0.05. Here p is "
         "looked for, and the chance of none is given."),
        (over(_COUNTS, lambda n: 1 - 0.95**n), "That is the chance of at least one where p is "
         "0.05. Here p is looked for."),
        (over(_COUNTS, lambda n: 1 - 0.025 ** (1 / n)), "That leaves 2.5 % on this side, as "
         "rvl.stats.success does, whose interval has two. Asked for are 5 % on one."),
        (over(_COUNTS, lambda n: -np.log(0.05) / n), "Nearly: log(1 - p) is not quite -p. For n = "
         "1 you say 3, which is no chance."),
        (over(_COUNTS, lambda n: 1 / (n + 2)), "That is Laplace's estimate, a guess and not a "
         "bound. Solve (1 - p)^n = 0.05 for p."),
        (over(_COUNTS, lambda n: 0.05), "That is the probability of none, which is given. Which p "
         "makes it so small?"),
    ]  # fmt: skip
    right = over(_COUNTS, lambda n: 1 - 0.05 ** (1 / n))
    known.append((100 * right, "As a fraction, not in percent."))
    recognise(found, right, known,
              f"For n = 10 you say {found[1]:.4g}. All ten fail with the probability (1 - p)^10: "
              "set it to 0.05, and solve for p.")  # fmt: skip


def two(answer: Any) -> Verdict:
    """Exercise 2: the natural step of one number.

    Args:
        answer: Function of the gradient, sigma and delta, of the change of theta.
    """
    return judge(
        answer,
        _step_mistake,
        "sqrt(delta) sigma, uphill: the gradient's size has fallen out, only its sign is left. A "
        "policy that is sure of its action, with a small sigma, moves little, an unsure one much: "
        "the change is counted in what the policy does, not in theta.",
    )


def _step_mistake(answer: Any) -> None:
    """Not the natural gradient, not normalised, or a slip on the way."""
    found = values(answer, _STEPS, "The change")
    known = [
        (over(_STEPS, lambda g, s, d: d * g), "That is plain gradient ascent, with delta as its "
         "rate. F = 1 / sigma^2 is missing, and the length."),
        (over(_STEPS, lambda g, s, d: s * s * g), "x = F^-1 g = sigma^2 g is the direction. Its "
         "length is still to be set: sqrt(delta / (g x)) times x."),
        (over(_STEPS, lambda g, s, d: d * s * s * g), "delta is no learning rate: the direction "
         "x = sigma^2 g is multiplied by sqrt(delta / (g x))."),
        (over(_STEPS, lambda g, s, d: np.sqrt(d) * s * s * g), "Divide by the root of g x as well, "
         "with x = sigma^2 g."),
        (over(_STEPS, lambda g, s, d: np.sqrt(d) * np.sign(g)), "That is the step of length "
         "sqrt(delta) in theta. It should be so long in what the policy does: F = 1 / sigma^2."),
        (over(_STEPS, lambda g, s, d: np.sqrt(d) * np.sign(g) / s), "You took F = sigma^2. The "
         "Fisher information of a mean is 1 / sigma^2: a sure policy tells more about its mean."),
        (over(_STEPS, lambda g, s, d: np.sqrt(d) * s), "The size is right. But which way? It "
         "depends on the sign of g."),
        (over(_STEPS, lambda g, s, d: -np.sqrt(d) * s * np.sign(g)), "That goes downhill: here "
         "something is maximised."),
        (over(_STEPS, lambda g, s, d: np.sqrt(2 * d) * s * np.sign(g)), "You asked for a KL "
         "divergence of delta. By the convention of the code it is delta / 2."),
        (over(_STEPS, lambda g, s, d: np.sqrt(d / 2) * s * np.sign(g)), "The KL divergence of that "
         "step is delta / 4. With sqrt(delta / (g x)) x it is delta / 2."),
        (over(_STEPS, lambda g, s, d: d * s * np.sign(g)), "A root is missing: the KL divergence "
         "grows with the square of the step."),
        (over(_STEPS, lambda g, s, d: np.sqrt(d) * s * s * np.sign(g)), "x = sigma^2 g, and the "
         "root of g x is sigma |g|: one sigma falls out."),
        (over(_STEPS, lambda g, s, d: np.sqrt(d / (g * g * s * s))), "That is the factor "
         "sqrt(delta / (g x)). Multiply x = sigma^2 g by it."),
    ]  # fmt: skip
    recognise(found, over(_STEPS, lambda g, s, d: np.sqrt(d) * s * np.sign(g)), known,
              f"For g = 0.3, sigma = 0.5 and delta = 0.05 you say {found[0]:.4g}. F = 1 / sigma^2; "
              "x = F^-1 g; the step is sqrt(delta / (g x)) x.")  # fmt: skip


def three(answer: Any) -> Verdict:
    """Exercise 3: the gate.

    Args:
        answer: Function of alpha, the moving average and the last success, of the next alpha.
    """
    return judge(
        answer,
        _gate_mistake,
        "It waits below 0.4, hurries above 0.8, and believes bad news at once and good news "
        "slowly. And it costs nothing: the success is that of the episodes that were trained on.",
    )


def _gate(alpha: float, m: float, s: float, *, slack: float = 0.1, top: float = 1.0) -> float:
    """The gate, with what can be left out of it."""
    trust = (min(m, s + slack) - 0.4) / 0.4
    return min(alpha + 0.03 * min(max(trust, 0.0), 1.0), top)


def _gate_mistake(answer: Any) -> None:
    """A clip that is missing, the wrong success, or the wrong scale."""
    found = values(answer, _PLACES, "The next alpha")
    known = [
        (over(_PLACES, lambda a, m, s: a + 0.03 * (min(m, s + 0.1) - 0.4) / 0.4), "Nothing is "
         "clipped: a good policy would go further than l, and beyond 1, a bad one backwards."),
        (over(_PLACES, lambda a, m, s: min(a + 0.03 * (min(m, s + 0.1) - 0.4) / 0.4, 1)), "The "
         "trust is not clipped to [0, 1]: above 0.8 you go further than l, below 0.4 backwards."),
        (over(_PLACES, lambda a, m, s: min(a + 0.03 * max((min(m, s + 0.1) - 0.4) / 0.4, 0), 1)),
         "Above a success of 0.8 you go further than l = 0.03, which is the largest step."),
        (over(_PLACES, lambda a, m, s: min(a + 0.03 * min((min(m, s + 0.1) - 0.4) / 0.4, 1), 1)),
         "Below a success of 0.4 you go back. The gate is closed there, and alpha stays."),
        (over(_PLACES, lambda a, m, s: _gate(a, m, s, top=9.0)), "There is no robot beyond the "
         "target: alpha ends at 1."),
        (over(_PLACES, lambda a, m, s: _gate(a, m, s, slack=9.0)), "You trust the average alone. "
         "When the last batch went badly, it counts for no more than s + 0.1."),
        (over(_PLACES, lambda a, m, s: _gate(a, s, s)), "You trust the last batch alone: one lucky "
         "batch would open the gate. That is what the average is for."),
        (over(_PLACES, lambda a, m, s: _gate(a, m, s, slack=0.0)), "The slack is missing: the "
         "average counts for up to s + 0.1."),
        (over(_PLACES, lambda a, m, s: _gate(a, max(m, s + 0.1), 9.0)), "You took the larger of "
         "the two. Bad news are to be believed: take the smaller."),
        (over(_PLACES, lambda a, m, s: min(a + 0.03 * (min(m, s + 0.1) > 0.4), 1)), "Open or "
         "closed is too simple: between 0.4 and 0.8 the step grows in proportion."),
        (over(_PLACES, lambda a, m, s: min(a + 0.03 * (min(m, s + 0.1) >= 0.8), 1)), "Open or "
         "closed is too simple: between 0.4 and 0.8 the step grows in proportion."),
        (over(_PLACES, lambda a, m, s: min(a + 0.03 * min(max((min(m, s + 0.1) - 0.4) / 0.8, 0), 1),
                                           1)), "You divided by 0.8. The gate opens from 0.4 to "
         "0.8, over a range of 0.4."),
        (over(_PLACES, lambda a, m, s: _gate(a, m, s) - a), "That is the step. Asked for is the "
         "next alpha."),
        (over(_PLACES, lambda a, m, s: min(a + 0.03, 1)), "That goes on whatever happens: a "
         "schedule, and no gate."),
    ]  # fmt: skip
    recognise(found, over(_PLACES, _gate), known,
              f"For alpha = 0.2 and m = s = 0.6 you say {found[0]:.4g}. That success is half way "
              "from 0.4 to 0.8, so the step is half of l.")  # fmt: skip
