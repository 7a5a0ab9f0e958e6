"""Demonstrations: what a teacher saw and did, as one record of arrays that is saved as npz."""

import dataclasses
import io
import lzma
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path

import numpy as np

from revolver_lab.errors import DemonstrationsError
from revolver_lab.files import output_file, write_atomically

_KINDS = {"lengths": np.int64, "observations": np.float32, "actions": np.float32,
          "next_observations": np.float32, "rewards": np.float64}  # fmt: skip
# Of a zip that is encrypted or packed in another way, and of a header that is none or asks for
# more memory than there is.
_TORN = (OSError, ValueError, EOFError, LookupError, TypeError, MemoryError, RuntimeError,
         OverflowError, SyntaxError, tokenize.TokenError, struct.error, zipfile.BadZipFile,
         zlib.error, lzma.LZMAError)  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Demonstrations:
    """Transitions of K episodes, one after another; row i is (s, a, s', r).

    Attributes:
        lengths: Transitions of each episode, (K,); they sum to N.
        observations: s, (N, O) float32.
        actions: a, as the teacher gave them, (N, A) float32.
        next_observations: s', (N, O) float32.
        rewards: r, unshaped, (N,); zeros where the source has none.
        origin: Where they come from, in a sentence.

    Example:
        >>> some = Demonstrations(lengths=[2], observations=[[0.0], [1.0]], actions=[[0.5], [0.5]],
        ...                       next_observations=[[1.0], [2.0]], rewards=[0.0, 1.0])
        >>> len(some), some.observation_size, some.action_size
        (1, 1, 1)
    """

    lengths: np.ndarray
    observations: np.ndarray
    actions: np.ndarray
    next_observations: np.ndarray
    rewards: np.ndarray
    origin: str = ""

    def __post_init__(self) -> None:
        """Takes the arrays over in their types, and refuses what does not belong together."""
        for name, kind in _KINDS.items():
            try:
                value = np.asarray(getattr(self, name))
                with np.errstate(over="ignore"):  # what is too large is refused as infinite
                    object.__setattr__(self, name, value.astype(kind, casting="same_kind"))
            except (TypeError, ValueError) as error:
                raise refusal(f"{name} that are no {np.dtype(kind)} numbers") from error
        problem = _problem(self)
        if problem:
            raise refusal(problem)

    def __len__(self) -> int:
        """Returns K, the number of episodes."""
        return len(self.lengths)

    @property
    def observation_size(self) -> int:
        """Returns O."""
        return self.observations.shape[1]

    @property
    def action_size(self) -> int:
        """Returns A."""
        return self.actions.shape[1]

    @property
    def returns(self) -> np.ndarray:
        """Returns the unshaped return of each episode, (K,)."""
        return np.add.reduceat(self.rewards, np.cumsum(self.lengths) - self.lengths)

    def fits(self, observation_size: int, action_size: int) -> "Demonstrations":
        """Returns the demonstrations themselves if they fit a robot of these sizes.

        Raises:
            DemonstrationsError: If they do not.
        """
        if (self.observation_size, self.action_size) != (observation_size, action_size):
            raise DemonstrationsError(
                f"demonstrations of {self.observation_size} observations and {self.action_size} "
                "actions", f"{observation_size} observations and {action_size} actions",
                "Record them on this robot, or on one of the same evolution.",
            )  # fmt: skip
        return self

    def save(self, path: str | Path) -> Path:
        """Saves the record as npz, atomically.

        Args:
            path: Name of the file; ".npz" is put on if it has no ending.

        Raises:
            SettingsError: If that is no name of a file.
        """
        path = output_file(path, ".npz")
        content = io.BytesIO()
        arrays = {name: getattr(self, name) for name in _KINDS}
        np.savez_compressed(content, origin=np.array(self.origin), **arrays)
        return write_atomically(path, content.getvalue())

    @classmethod
    def load(cls, path: str | Path) -> "Demonstrations":
        """Loads plain arrays; nothing in the file is ever executed.

        Args:
            path: An npz with at least lengths (K,), observations (N, O) and actions (N, A).
                Where there are no next_observations, the last transition of each episode is left
                out, since nothing says where it led.

        Raises:
            DemonstrationsError: If it is missing, torn, or of another kind.
        """
        try:
            found = _arrays(path)
        except _TORN as error:
            raise refusal(f"the file {str(path)!r}, which cannot be read") from error
        lacking = {"lengths", "observations", "actions"} - set(found)
        if lacking:
            raise refusal(f"the file {str(path)!r} without {sorted(lacking)}")
        origin = str(found.pop("origin", Path(path).name))
        return cls(**_completed(found), origin=origin)


def shifted(observations: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns where each observation led within its episode, and which rows that is known of.

    Args:
        observations: (N, O), episodes one after another.
        lengths: Of the episodes, (K,).

    Returns:
        The observation one row further, (N, O), and a mask, (N,), false at the episodes' ends.

    Example:
        >>> shifted(np.array([[0.0], [1.0], [5.0]]), np.array([2, 1]))[1]
        array([ True, False, False])
    """
    known = np.ones(len(observations), bool)
    known[np.cumsum(lengths) - 1] = False
    return np.roll(observations, -1, axis=0), known


def _arrays(path: str | Path) -> dict[str, np.ndarray]:
    """Reads the arrays of an npz by name; a file of another kind is a TypeError."""
    file = np.load(path, allow_pickle=False)
    if not isinstance(file, np.lib.npyio.NpzFile):  # a single array
        raise TypeError("no npz")
    with file:
        found = {name: file[name] for name in (*_KINDS, "origin") if name in file}
    if not all(isinstance(value, np.ndarray) for value in found.values()):
        raise TypeError("no arrays")
    return found


def _completed(found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Fills in rewards of 0, and next observations where the file has none."""
    scalars = [name for name, value in found.items() if value.ndim == 0]
    if scalars:
        raise refusal(f"{scalars} without rows")
    found.setdefault("rewards", np.zeros(len(found["observations"])))
    if "next_observations" in found:
        return found
    rows = {name: found[name] for name in _KINDS if name in found and name != "lengths"}
    lengths = found["lengths"]
    whole = lengths.ndim == 1 and lengths.dtype.kind in "iu" and len(lengths) > 0
    # Lengths are bounded before they are added up: their sum could come round to what is right.
    whole = whole and lengths.min() >= 2 and lengths.max() <= len(rows["observations"])
    if not whole or {len(x) for x in rows.values()} != {lengths.sum()}:
        raise refusal(f"arrays of {[len(x) for x in rows.values()]} rows in episodes of "
                      f"{lengths.tolist()[:5]}, ...")  # fmt: skip
    following, known = shifted(rows["observations"], lengths)
    rows = {name: x[known] for name, x in (rows | {"next_observations": following}).items()}
    return rows | {"lengths": lengths - 1}


def _problem(some: Demonstrations) -> str | None:
    """Says what is wrong with the arrays, or None."""
    shapes = {name: getattr(some, name).shape for name in _KINDS}
    dimensions = {"lengths": 1, "rewards": 1}
    for name, shape in shapes.items():
        if len(shape) != dimensions.get(name, 2):
            return f"{name} of shape {shape}"
        if not np.isfinite(getattr(some, name)).all():
            return f"numbers in {name} that are not finite"
    if not len(some.lengths) or some.lengths.min() < 1:
        return f"episodes of {some.lengths.tolist()[:5]} transitions"
    if some.lengths.max() > len(some.observations):
        return f"episodes of {some.lengths.tolist()[:5]} transitions in {len(some.observations)}"
    if {shape[0] for name, shape in shapes.items() if name != "lengths"} != {some.lengths.sum()}:
        return f"arrays of shapes {shapes} for {some.lengths.sum()} transitions"
    if shapes["observations"] != shapes["next_observations"]:
        return f"observations {shapes['observations']} that lead to {shapes['next_observations']}"
    return None


def refusal(what: str) -> DemonstrationsError:
    """Builds the error for what cannot be demonstrations."""
    return DemonstrationsError(
        what, "lengths (K,), observations (N, O), actions (N, A) of finite numbers",
        "Record them by revolver_lab.demonstration_sources.record, or check the file's source.",
    )  # fmt: skip
