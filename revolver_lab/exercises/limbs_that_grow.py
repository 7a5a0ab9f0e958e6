"""Checks of notebook 07: how wild no limb is, where the zeros go, and what a student is told."""

from typing import Any

import numpy as np

from revolver_lab.exercises.recognising import over, recognise, values
from revolver_lab.exercises.verdict import NotYet, Verdict, call, judge

TEXTS = {
    "one": "All lengths of a limb are multiplied by k, its density stays, and the torque of its "
    "motor is multiplied by k as well. How many times as large is the angular acceleration that "
    "the motor gives to the limb at its hinge? Write a function of k.",
    "two": "A policy's first layer has a matrix `weight`, one row for each hidden unit and one "
    "column for each observation. The grown robot observes `size` numbers; the old ones stand at "
    "`places`, an array with one place for each old column. Write a function of weight, places and "
    "size: the matrix of the lifted policy, which acts as before.",
    "three": "In a step a limb moves by g a - load: g is how much its motor can do, load is how "
    "much its weight pulls. The teacher's limb weighs nothing, and moved by g_teacher a. A student "
    "who knows its own limb (g_student, load) is asked which action makes the same movement. Write "
    "a function of a, g_teacher, g_student and load; actions end at -1 and 1.",
}
"""What each exercise asks."""

_SIZES = ((0.5,), (0.02,), (2.0,))
_WEIGHT = np.array([[1.0, 2.0, 3.0], [-4.0, 5.0, 0.5]])
_LIFTS = ((_WEIGHT, np.array([0, 2, 3]), 5), (_WEIGHT, np.array([3, 0, 2]), 4))
_TOLD = ((0.5, 0.02, 1.0, 0.3), (-1.0, 0.02, 2.0, 0.3), (0.5, 1.0, 1.0, 0.0),
         (1.0, 1.0, 0.5, 0.4), (-0.9, 1.0, 0.5, 0.2))  # fmt: skip


def one(answer: Any) -> Verdict:
    """Exercise 1: how a motor accelerates its shrunken limb.

    Args:
        answer: Function of k, of the acceleration's factor.
    """
    return judge(
        answer,
        _size_mistake,
        "k to the power -4: at k = 0.02, six million times. A limb of no size would be the wildest "
        "part of the robot. The cheetah's hinge has an armature that does not shrink: next to it "
        "the limb's own inertia is nothing, and what the motor does fades with k.",
    )


def _size_mistake(answer: Any) -> None:
    """A power too few, the torque or the lever forgotten, or upside down."""
    found = values(answer, _SIZES, "The factor")
    known = [
        (-5, "The limb's inertia is right, k^5. But the torque shrinks too, by k."),
        (5, "That is how the inertia shrinks. Acceleration is torque over inertia."),
        (4, "Upside down: the inertia is in the denominator."),
        (-2, "You divided by the mass, k^3. For turning it is the moment of inertia that counts: "
         "mass times distance squared."),
        (-3, "A power too few. If you took k / k^4: the distance to the hinge counts squared in "
         "the inertia. If you took 1 / k^3: that is the mass, and the torque is missing."),
        (3, "That is how the mass shrinks. For turning, the distance to the hinge counts as well, "
         "and the acceleration is torque over that."),
        (1, "The torque shrinks so. But the limb that it turns becomes lighter, and much faster "
         "so."),
        (0, "Torque and limb do not shrink alike: the torque by k, the mass alone by k^3 already."),
        (-1, "Volume goes with k^3, not with k^2, and the distance to the hinge counts squared."),
    ]  # fmt: skip
    recognise(found, over(_SIZES, lambda k: k**-4.0),
              [(over(_SIZES, lambda k, p=p: k ** float(p)), text) for p, text in known],
              f"For k = 0.5 you say {found[0]:.4g}. Mass goes with k^3, the moment of inertia with "
              "mass times length squared; divide the torque, k, by it.")  # fmt: skip


def two(answer: Any) -> Verdict:
    """Exercise 2: zero insertion.

    Args:
        answer: Function of a matrix, the places of its columns and the new number of columns.
    """
    return judge(
        answer,
        _lift_mistake,
        "Zeros where the new observations stand, the old columns where the old ones stand now. "
        "Whatever the new limb does, the lifted policy does not see it, and acts as before.",
    )


def _lift_mistake(answer: Any) -> None:
    """Columns at the wrong places, something other than zeros between them, or another shape."""
    for weight, places, size in _LIFTS:
        found = _matrix(call(answer, weight.copy(), places.copy(), size), weight, size)
        right = np.zeros((len(weight), size))
        right[:, places] = weight
        in_order = np.zeros_like(right)
        in_order[:, np.sort(places)] = weight
        empty = np.setdiff1d(np.arange(size), places)
        pad = size - weight.shape[1]
        recognise(found, right, [
            (np.pad(weight, ((0, 0), (0, pad))), "The new zeros stand at the end. But the new "
             "joint stands between the old ones, and every column behind it would look at "
             "something else than before: use `places`."),
            (np.pad(weight, ((0, 0), (pad, 0))), "The new zeros stand at the front, and every "
             "old column looks at something else than before: use `places`."),
            (in_order, "The columns went to the right set of places, but in another order: column "
             "i belongs at places[i]."),
            (np.zeros_like(right), "Everything is zero: the old columns are missing."),
        ], _otherwise(found, right, empty))  # fmt: skip


def _matrix(found: Any, weight: np.ndarray, size: int) -> np.ndarray:
    """Returns a student's matrix, if it has the right shape and holds finite numbers."""
    try:
        matrix = np.asarray(found, dtype=float)
    except (TypeError, ValueError):
        raise NotYet(f"A matrix is asked for; you returned a {type(found).__name__}.") from None
    wanted = (len(weight), size)
    if matrix.shape == weight.shape != wanted:
        raise NotYet("That has as many columns as before. The grown robot observes more.")
    if matrix.shape == wanted[::-1] != wanted:
        raise NotYet("Rows and columns are swapped: a row for each hidden unit.")
    if matrix.shape == (size, weight.shape[1]):
        raise NotYet("You inserted rows. A new row is a new hidden unit; a new observation is a "
                     "new column.")  # fmt: skip
    if matrix.shape != wanted:
        raise NotYet(f"A matrix of shape {wanted} is asked for, yours has {matrix.shape}.")
    if not np.isfinite(matrix).all():
        raise NotYet("Some of the numbers are not finite. Begin with np.zeros, not with np.empty.")
    return matrix


def _otherwise(found: np.ndarray, right: np.ndarray, empty: np.ndarray) -> str:
    """Says what is wrong with a matrix of the right shape."""
    kept = np.delete(found, empty, axis=1)
    if np.allclose(kept, np.delete(right, empty, axis=1)):
        return ("The old columns are in place, but the new ones are not zero: the policy would "
                "listen to a limb that it knows nothing of.")  # fmt: skip
    if np.allclose(found[:, empty], 0):
        return ("The new columns are zero, but the old ones are not what and where they were: "
                "column i goes to places[i], unchanged.")  # fmt: skip
    return "Begin with a matrix of zeros, and put column i of the old one at places[i]."


def three(answer: Any) -> Verdict:
    """Exercise 3: what a perfect inverse model tells.

    Args:
        answer: Function of a, g_teacher, g_student and load, of the action.
    """
    return judge(
        answer,
        _told_mistake,
        "With g_teacher near 0 it is load / g_student, whatever a was: hold still. What a teacher "
        "sends to a limb that is hardly there leaves a trace too small for a grown limb to follow, "
        "and a student who looks at states alone is told to hold up its limb, not to use it.",
    )


def _told_mistake(answer: Any) -> None:
    """Copied the action, forgot or turned the load, or went beyond what actions may be."""
    found = values(answer, _TOLD, "The action")

    def of(formula: Any, cut: bool = True) -> np.ndarray:
        told = over(_TOLD, formula)
        return np.clip(told, -1, 1) if cut else told

    recognise(found, of(lambda a, t, s, w: (t * a + w) / s), [
        (of(lambda a, t, s, w: a), "That copies the teacher's action, as behaviour cloning does. "
         "SOIL does not look at it: it asks what moves the student's limb as the teacher's moved."),
        (of(lambda a, t, s, w: (t * a + w) / s, cut=False), "Right, but for the ends: no action is "
         "above 1 or below -1."),
        (of(lambda a, t, s, w: t * a / s), "The load is missing. The teacher's limb weighed "
         "nothing; the student's has to be held up as well."),
        (of(lambda a, t, s, w: t * a / s, cut=False), "The load is missing, and so are the ends: "
         "the student's limb has to be held up as well, by actions from -1 to 1."),
        (of(lambda a, t, s, w: (t * a - w) / s), "The load has the wrong sign: g a - load has to "
         "be what the teacher's limb did, so g a has to be load more than that."),
        (of(lambda a, t, s, w: w / s), "Nearly, where g_teacher is small. But the teacher's limb "
         "did move, by g_teacher a."),
        (of(lambda a, t, s, w: t * a + w), "That is the movement that the motor has to make. "
         "Divide by how much the motor can do."),
        (of(lambda a, t, s, w: a + w / s), "You took the teacher's action whole. Its motor did "
         "less than the student's would: it is the movements that are to be equal."),
        (of(lambda a, t, s, w: t * a / s + w), "The load is a movement too: it is divided by "
         "g_student as well."),
        (of(lambda a, t, s, w: (s * a + w) / t), "Teacher and student are swapped."),
        (of(lambda a, t, s, w: s * a - w), "That is how the student's limb moves if it copies the "
         "action. Asked is the other way round: from a movement to an action."),
        (of(lambda a, t, s, w: 0.0), "With no action the student's limb sinks by load."),
    ], f"For a = 0.5, g_teacher = 0.02, g_student = 1 and load = 0.3 you say {found[0]:.4g}. Solve "
        "g_student x - load = g_teacher a for x, and cut it at -1 and 1.")  # fmt: skip
