"""The interpolation functions f of section 4.1: continuous, f(0) = 0, f(1) = 1."""

import fnmatch
import re
from collections.abc import Callable, Mapping

import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.given import is_number

Ramp = Callable[[float], float]
RampSpec = str | Ramp | Mapping[str, "str | Ramp"]

# f is sampled here: dense enough that a jump of more than 1/4 is a jump and not a steep slope.
_SAMPLES = np.linspace(0.0, 1.0, 4097)
_JUMP = 0.25
_ROUNDING = 1e-9
_DECADES = np.log(1e8)


def linear(alpha: float) -> float:
    """f(alpha) = alpha, the choice of the paper.

    Example:
        >>> linear(0.25)
        0.25
    """
    return alpha


def smoothstep(alpha: float) -> float:
    """f(alpha) = alpha^2 (3 - 2 alpha): the robot changes slowly at both ends.

    Example:
        >>> smoothstep(0.5)
        0.5
    """
    return alpha * alpha * (3.0 - 2.0 * alpha)


def release(alpha: float) -> float:
    """f of what holds a joint still, which lets go by equal factors and not by equal amounts.

    Ten thousand times a joint's own inertia, reduced by equal amounts, still locks the joint when
    all but a hundredth of the way is done. This f leaves a 1e-8 alpha'th part of it, and 0 at 1.

    Example:
        >>> f"{1 - release(0.25):.0e}, {1 - release(0.5):.0e}"
        '1e-02, 1e-04'
    """
    return float(np.expm1(-_DECADES * alpha) / np.expm1(-_DECADES))


def ramp(start: float, stop: float) -> Ramp:
    """A parameter that changes linearly on [start, stop] only and rests outside.

    Args:
        start: alpha at which the change begins, in [0, 1).
        stop: alpha at which it is complete, in (start, 1].

    Returns:
        f with f(start) = 0 and f(stop) = 1.

    Raises:
        ParameterError: If not 0 <= start < stop <= 1.

    Example:
        >>> early = ramp(0.0, 0.5)
        >>> early(0.25), early(0.75)
        (0.5, 1.0)
    """
    if not (is_number(start) and is_number(stop) and 0.0 <= start < stop <= 1.0):
        raise ParameterError(
            f"ramp({start!r}, {stop!r})", "0 <= start < stop <= 1", "Give a part of [0, 1]."
        )
    return lambda alpha: min(max((alpha - start) / (stop - start), 0.0), 1.0)


NAMED: dict[str, Ramp] = {"linear": linear, "smoothstep": smoothstep}


def checked(f: str | Ramp) -> Ramp:
    """The function that f names, after checking what E needs of it.

    Args:
        f: One of the names in `NAMED`, or a callable of alpha.

    Raises:
        ParameterError: If f is unknown, not finite, leaves its ends, or jumps.

    Example:
        >>> checked("linear")(0.5)
        0.5
    """
    if isinstance(f, str):
        if f not in NAMED:
            raise ParameterError(
                f"f = {f!r}", f"one of {sorted(NAMED)} or a callable", "Choose one of these."
            )
        return NAMED[f]
    if not callable(f):
        raise ParameterError(f"f = {f!r}", f"one of {sorted(NAMED)} or a callable", "Pass one.")
    try:
        values = np.array([float(f(float(alpha))) for alpha in _SAMPLES])
    except (TypeError, ValueError, ArithmeticError) as error:
        raise ParameterError(
            f"f, which raised {error!r} on [0, 1]", "a number for every alpha", "Mend f."
        ) from error
    _check_values(values)
    return f


def _check_values(values: np.ndarray) -> None:
    """Refuse sampled values of f that a continuous path from 0 to 1 cannot have."""
    if not np.isfinite(values).all():
        raise ParameterError("f with a value that is not finite", "finite values", "Mend f.")
    if abs(values[0]) > _ROUNDING or abs(values[-1] - 1.0) > _ROUNDING:
        raise ParameterError(
            f"f(0) = {values[0]:g}, f(1) = {values[-1]:g}", "f(0) = 0 and f(1) = 1", "Rescale f."
        )
    if values.min() < -_ROUNDING or values.max() > 1.0 + _ROUNDING:
        raise ParameterError(
            f"f with values in [{values.min():g}, {values.max():g}]", "[0, 1]", "Clip f."
        )
    jump = np.abs(np.diff(values)).max()
    if jump > _JUMP:
        raise ParameterError(
            f"f with a jump of {jump:.2g}",
            "a continuous f",
            "Use a ramp, or switch=... for what is discrete.",
        )


def _matches(name: str, pattern: str) -> bool:
    """Whether a pattern is a name of theta, with its unit or without, or matches the latter.

    Example:
        >>> _matches("geom/foot/size[0] [m]", "geom/foot/size[0]")
        True
    """
    bare = re.sub(r" \[[^][]*\]$", "", name)
    return pattern in (name, bare) or fnmatch.fnmatchcase(bare, pattern)


class Ramps:
    """f for every parameter: one function for all, or patterns over the names of theta.

    Args:
        f: A name, a callable, or a mapping of theta's names, or of patterns (as in `fnmatch`), to
            either; the first that matches wins, and what matches none is linear.

    Example:
        >>> ramps = Ramps({"geom/foot/*": ramp(0.5, 1.0)})
        >>> group = ramps.groups(["geom/foot/size[0]", "geom/shin/size[0]"])
        >>> ramps(0.5)[group]
        array([0. , 0.5])
    """

    def __init__(self, f: RampSpec):
        table = dict(f) if isinstance(f, Mapping) else {"*": f}
        self.patterns = [*table, "*"]
        self.functions = [*(checked(function) for function in table.values()), linear]

    def groups(self, names: list[str]) -> np.ndarray:
        """For each name, the index of the function that moves it, (D,) int.

        Raises:
            ParameterError: If a pattern matches no name at all.
        """
        for pattern in self.patterns[:-1]:
            if not any(_matches(name, pattern) for name in names):
                raise ParameterError(
                    f"f for {pattern!r}, which matches no parameter",
                    "patterns over evolve.theta_names, such as 'geom/*/size*'",
                    "Print evolve.theta_names and mend the pattern.",
                )
        matches = (
            next(i for i, pattern in enumerate(self.patterns) if _matches(name, pattern))
            for name in names
        )
        return np.fromiter(matches, dtype=int, count=len(names))

    def __call__(self, alpha: float) -> np.ndarray:
        """f(alpha) of every function, (number of functions,); 0 and 1 exactly at the ends."""
        if alpha in (0.0, 1.0):
            return np.full(len(self.functions), float(alpha))
        return np.clip([float(function(alpha)) for function in self.functions], 0.0, 1.0)
