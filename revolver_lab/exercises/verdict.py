"""What a check says: not answered yet, not right yet and why, or right."""

import html
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

_COLOURS = {"open": "#8a94a6", "wrong": "#d9822b", "right": "#2e8b57"}
_WORDS = {"open": "Not answered yet", "wrong": "Not yet", "right": "Right"}


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a check found.

    Attributes:
        state: "open", "wrong" or "right".
        message: Which misconception it looks like, or what the right answer means.
    """

    state: str
    message: str

    @property
    def right(self) -> bool:
        """Whether the answer is right."""
        return self.state == "right"

    def __repr__(self) -> str:
        return f"{_WORDS[self.state]}. {self.message}"

    def _repr_html_(self) -> str:
        """The same in a notebook, as a box that screen readers announce."""
        style = f"border-left:4px solid {_COLOURS[self.state]};padding:.3em .8em"
        words = f"<b>{_WORDS[self.state]}.</b> {html.escape(self.message)}"
        return f'<div role="status" style="{style}">{words}</div>'


class NotYet(Exception):
    """Raised inside a check with the message for the student; `judge` turns it into a verdict."""


def judge(answer: Any, find_mistake: Callable[[Any], None], praise: str) -> Verdict:
    """Look at an answer, whatever it is: no answer of a student ends in a traceback.

    Args:
        answer: The answer; `...` and None mean that there is none yet.
        find_mistake: Raises NotYet if the answer is wrong.
        praise: What the right answer means.

    Example:
        >>> judge(..., print, "Yes.")
        Not answered yet. Put your answer in place of the dots, and run the cell again.
    """
    if answer is ... or answer is None:
        message = "Put your answer in place of the dots, and run the cell again."
        return Verdict(state="open", message=message)
    try:
        find_mistake(answer)
    except NotYet as mistake:
        return Verdict(state="wrong", message=str(mistake))
    except Exception as error:  # an object that fails when it is asked for its numbers
        message = f"The answer cannot be read: {type(error).__name__}: {error}"
        return Verdict(state="wrong", message=message)
    return Verdict(state="right", message=praise)


def call(answer: Any, *given: Any) -> Any:
    """What the student's function returns.

    Raises:
        NotYet: If it is no function, fails, or returns nothing.
    """
    shown = ", ".join(f"{value:g}" if isinstance(value, float) else repr(value) for value in given)
    if not callable(answer):
        raise NotYet(
            f"The answer is of type {type(answer).__name__}, but a function is asked for, such as "
            "`lambda alpha: ...`."
        )
    try:
        found = answer(*given)
    except Exception as error:
        raise NotYet(
            f"Your function stopped at ({shown}) with {type(error).__name__}: {error}"
        ) from error
    if found is None or found is ...:
        raise NotYet(f"Your function returned {found!r} for ({shown}). Is a `return` missing?")
    return found


def numbers(found: Any, size: int | None, what: str) -> np.ndarray:
    """What was found as an array, (size,), or as a scalar array where size is None.

    Raises:
        NotYet: If it is something else, or not finite.
    """
    try:
        array = np.asarray(found, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise NotYet(f"{what} is {found!r}, which is no number.") from None
    if array.shape != (() if size is None else (size,)):
        wanted = "one number" if size is None else f"{size} numbers"
        raise NotYet(f"{what} has shape {array.shape}; {wanted} are needed.".replace(
            "number are", "number is"))  # fmt: skip
    if not np.isfinite(array).all():
        raise NotYet(f"{what} is {found!r}, which is not finite.")
    return array
