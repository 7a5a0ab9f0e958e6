"""Checks of notebook 03: drawing a robot, counting phases, and cleaning the replay."""

from typing import Any

import numpy as np

from revolver_lab.exercises.recognising import parts, recognise
from revolver_lab.exercises.verdict import NotYet, Verdict, call, judge, numbers

TEXTS = {
    "one": "Line 14 of Algorithm 1. Write a function of alpha, xi and rng (NumPy's random "
    "generator) that draws beta ~ Uniform(alpha, min(alpha + xi, 1)).",
    "two": "l_k = 0.03, N_e = 16 episodes a phase, and 100 in the last phase, the one at alpha = "
    "1; an episode has 200 steps, and 8 simulations share the work. Give three numbers: how many "
    "phases there are, the first at alpha = 0 and the last at alpha = 1; how many environment "
    "steps that makes, all simulations together; and the smallest N_e with which every "
    "simulation can finish an episode in each phase.",
    "three": "Line 31. A new phase begins at alpha. Write a function of betas (an array, one of "
    "each transition in the replay), alpha and xi, that returns the betas that stay.",
}
"""What each exercise asks."""

ALPHA_STEP, EPISODES, FINAL_EPISODES, EPISODE_STEPS, SIMULATIONS = 0.03, 16, 100, 200, 8
"""The run of exercise 2."""

_WINDOWS = ((0.1, 0.3), (0.52, 0.3), (0.96, 0.12))
_BETAS = np.array([0.12, 0.2, 0.16, 0.28, 0.24, 0.23, 0.31, 0.04, 0.19])
"""A replay at the end of the phase at alpha = 0.2 with xi = 0.12: some are left from before."""


def one(answer: Any) -> Verdict:
    """Exercise 1: draw beta.

    Args:
        answer: Function of alpha, xi and rng.
    """
    return judge(
        answer,
        _draw_mistake,
        "Every robot of the window is as likely as any other; some lie beyond the next phase's "
        "alpha already, for xi > l_k, and none lies beyond the target.",
    )


def _draw_mistake(answer: Any) -> None:
    """Draws outside the window, or not evenly within it."""
    first = [float(numbers(call(answer, *_WINDOWS[0], np.random.default_rng(3)), None, "beta"))
             for _ in range(2)]  # fmt: skip
    for alpha, xi in _WINDOWS:
        rng = np.random.default_rng(0)
        draws = [numbers(call(answer, alpha, xi, rng), None, "beta") for _ in range(1000)]
        _window_mistake(np.array(draws), alpha, xi)
    if first[0] != first[1]:
        raise NotYet(
            "Two generators of one seed gave two betas: the draw is not from `rng`. Then a seed no "
            "longer repeats a run. Use `rng.uniform`, not `np.random` or `random`."
        )


def _window_mistake(draws: np.ndarray, alpha: float, xi: float) -> None:
    """What 1000 draws for one window give away."""
    low, high = draws.min(), draws.max()
    where = f"At alpha = {alpha}, xi = {xi} you drew betas from {low:.3f} to {high:.3f}."
    end = min(alpha + xi, 1.0)
    if np.ptp(draws) == 0 and alpha <= low <= end:
        raise NotYet(f"{where} Every draw is the same: that is the deterministic variant. Draw.")
    if high > 1:
        raise NotYet(f"{where} There are no robots beyond alpha = 1: the window ends there.")
    if (draws == 1).sum() > 1:
        raise NotYet(
            f"{where} Many are exactly 1: you drew first and cut then, so the target is far more "
            "likely than its neighbours. Cut the window, then draw."
        )
    if 0 <= low < alpha and high <= xi:
        raise NotYet(f"{where} The window begins at alpha, not at 0: add alpha.")
    if low < alpha:
        raise NotYet(
            f"{where} The window reaches back behind alpha, to robots that are done with. It "
            "begins at alpha and looks ahead."
        )
    if high > end:
        raise NotYet(f"{where} That is beyond alpha + xi = {alpha + xi:g}.")
    if 0.95 * xi < high <= xi < end:
        raise NotYet(
            f"{where} The window ends at alpha + xi, not at xi: rng.uniform takes two ends, not an "
            "end and a width."
        )
    _evenness_mistake(draws, alpha, end, where)


def _evenness_mistake(draws: np.ndarray, alpha: float, end: float, where: str) -> None:
    """Whether the four quarters of the window are about equally full: 250 +- 14 each."""
    quarters = np.histogram(draws, bins=4, range=(alpha, end))[0]
    if np.abs(quarters - 250).max() > 70:
        raise NotYet(
            f"{where} The quarters of the window get {quarters.tolist()} of 1000 draws. Uniform "
            "means about 250 each: check both ends of the window."
        )


def two(answer: Any) -> Verdict:
    """Exercise 2: phases, steps, and the shortest phase.

    Args:
        answer: Three numbers.
    """
    return judge(
        answer,
        _counting_mistake,
        "The last step is shorter than the others, and alpha ends at exactly 1. With fewer "
        "episodes than simulations a phase would end before every simulation has met its robots.",
    )


def _counting_mistake(answer: Any) -> None:
    """Fence posts, forgotten phases, and simulations taken for robots of their own budget."""
    names = ("phases", "steps", "smallest N_e")
    given = parts(answer, names)
    phases, steps, least = (
        float(numbers(part, None, name)) for part, name in zip(given, names, strict=True)
    )
    recognise(phases, 35, [
        (33, "33 steps of 0.03 reach alpha = 0.99. The last step is shorter, and the phase at "
         "alpha = 0 counts as well."),
        (34, "34 steps are taken between phases, or else the short last one is forgotten. Phases "
         "are the posts, steps the gaps: count both ends."),
        (100 / 3, "A third of a phase cannot be: alpha ends at exactly 1, with a shorter step."),
        (100 / 3 + 1, "A third of a phase cannot be: the last step is shorter, not the phase."),
    ], f"{phases:g} phases? List their alphas: 0, 0.03, 0.06, ..., 0.99, 1.")  # fmt: skip
    episodes = 34 * EPISODES + FINAL_EPISODES
    recognise(steps, episodes * EPISODE_STEPS, [
        (episodes, "Those are episodes; each has 200 steps."),
        (35 * EPISODES * EPISODE_STEPS, "The last phase has 100 episodes, not 16."),
        (34 * EPISODES * EPISODE_STEPS, "The last phase is missing, 100 episodes at alpha = 1."),
        (35 * EPISODES * EPISODE_STEPS + FINAL_EPISODES * EPISODE_STEPS, "You counted the last "
         "phase twice: as one of 16 episodes, and as one of 100."),
        (episodes * EPISODE_STEPS * SIMULATIONS, "The 8 simulations share the N_e episodes; they "
         "do not play N_e each."),
        (episodes * EPISODE_STEPS / SIMULATIONS, "That is what one simulation does. Cost is "
         "counted whole: all simulations together."),
    ], f"{steps:g} steps? 34 phases have 16 episodes each, the last has 100.")  # fmt: skip
    recognise(least, SIMULATIONS, [
        (1, "With one episode a phase, a single simulation finishes it and 7 are still on robots "
         "of earlier phases: beta is drawn anew only when an episode ends."),
        (EPISODE_STEPS, "That is counted in steps; N_e counts episodes."),
        (EPISODES, "16 is what we have. How far down could we go?"),
        (SIMULATIONS * EPISODE_STEPS, "Those are the steps of the shortest phase. In episodes?"),
    ], f"N_e = {least:g}? Eight simulations, and each needs one episode.")  # fmt: skip


def three(answer: Any) -> Verdict:
    """Exercise 3: which betas survive the cleaning.

    Args:
        answer: Function of betas, alpha and xi.
    """
    return judge(
        answer,
        _cleaning_mistake,
        "What stays was earned on robots that may be drawn again. The upper end of [alpha, alpha + "
        "xi] never cuts anything, for alpha only grows; the lower end does the work.",
    )


def _cleaning_mistake(answer: Any) -> None:
    """Kept too much, too little, or the wrong side; alpha is that of the new phase."""
    for alpha, xi in ((0.2, 0.12), (0.24, 0.12), (0.24, 0.0)):
        betas = _BETAS if xi else np.array([0.2, 0.2, 0.24, 0.24])
        kept = betas[betas >= alpha]
        given = call(answer, betas.copy(), alpha, xi)
        found = np.asarray(given, dtype=object)
        if found.ndim != 1 or (found.size and isinstance(found[0], bool | np.bool_)):
            raise NotYet("Return the betas that stay, in their order: `betas[condition]`. A "
                         "condition alone says which ones they are.")  # fmt: skip
        _kept_mistake(numbers(given, found.size, "What stays"), betas, kept, alpha, xi)


def _kept_mistake(
    found: np.ndarray, betas: np.ndarray, kept: np.ndarray, alpha: float, xi: float
) -> None:
    """Recognises a wrong choice of betas."""
    known = [
        (betas, "Nothing was dropped: what earlier robots did stays in the replay."),
        (betas[(betas >= alpha) & (betas < alpha + xi)], "Right as long as there is a window. With "
         "xi = 0 it is alpha alone, and alpha + xi belongs to it: <=, not <."),
        (betas[:0], "Nothing stays in your answer, but some of these betas lie in the window: it "
         "ends at alpha + xi, not at xi."),
        (betas[betas > alpha], "A beta equal to alpha is a robot of this phase and stays: >=, not "
         ">. With xi = 0 you would drop everything, always."),
        (betas[betas < alpha], "You kept what is outdated and dropped the rest."),
        (betas[betas <= alpha], "You kept what is outdated and dropped the rest."),
        (betas[betas >= alpha - xi], "That window reaches back to alpha - xi; the paper's begins "
         "at alpha."),
        (np.flatnonzero(betas >= alpha), "Those are places in the array, not betas."),
        (np.sort(kept), "The right ones in another order. A replay keeps the order in which they "
         "came."),
    ]  # fmt: skip
    if found.shape == kept.shape and np.array_equal(found, kept):
        return
    for wrong, message in known:
        if found.shape == wrong.shape and np.array_equal(found, wrong):
            raise NotYet(message)
    raise NotYet(
        f"For the betas {betas.tolist()}, alpha = {alpha}, xi = {xi} you kept "
        f"{np.round(found, 3).tolist()}. Which of them lie in [alpha, alpha + xi]?"
    )
