"""What the checks share: answers of several parts, and mistakes known by their numbers."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from revolver_lab.exercises.verdict import NotYet, call, numbers


def parts(answer: Any, names: Sequence[str]) -> list[Any]:
    """Returns the parts of an answer such as `(25, 0.2)`, in order.

    Args:
        answer: What the student gave.
        names: What each part is, for the message.

    Raises:
        NotYet: If they are not that many.
    """
    listed = ", ".join(names)
    if callable(answer):
        raise NotYet(f"No function is asked for, but {len(names)} things in brackets: ({listed}).")
    listed_so = isinstance(answer, tuple | list) or (isinstance(answer, np.ndarray) and answer.ndim)
    if not listed_so or len(answer) != len(names):
        raise NotYet(f"Give {len(names)} things in brackets, in this order: ({listed}).")
    return list(answer)


def values(answer: Any, cases: Sequence[tuple], what: str) -> np.ndarray:
    """Returns what a student's function gives for each case, one number each, (len(cases),).

    Args:
        answer: The function.
        cases: Its arguments.
        what: What it returns, for the message.

    Raises:
        NotYet: If it is no function, fails, or returns no number.
    """
    return np.array([float(numbers(call(answer, *case), None, what)) for case in cases])


def recognise(
    found: np.ndarray | float,
    right: np.ndarray | float,
    known: Sequence[tuple[Any, str]],
    otherwise: str,
    near: float = 1e-4,
) -> None:
    """Says which mistake a wrong answer is; says nothing of a right one.

    Args:
        found: The answer.
        right: The right one, of the same shape.
        known: Wrong answers, of the same shape, each with its message.
        otherwise: Message for the others.
        near: How near counts as the same, relative to each number.

    Raises:
        NotYet: If the answer is wrong.

    Example:
        >>> recognise(2.0, 3.0, [(2.0, "You forgot the last phase.")], "No.")
        Traceback (most recent call last):
        ...
        revolver_lab.exercises.verdict.NotYet: You forgot the last phase.
    """

    def same(other: np.ndarray | float) -> bool:
        return np.allclose(found, other, rtol=near, atol=1e-9)

    if same(right):
        return
    for wrong, message in known:
        if same(wrong):
            raise NotYet(message)
    raise NotYet(otherwise)


def over(cases: Sequence[tuple], formula: Callable[..., float | np.ndarray]) -> np.ndarray:
    """Returns a formula's value for each case, (len(cases),)."""
    return np.array([formula(*case) for case in cases], dtype=float)
