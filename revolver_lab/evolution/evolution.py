"""E: [0, 1] -> robots, the continuous evolution of section 4.1."""

import copy
import math
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from revolver_lab import _gl
from revolver_lab.errors import AlphaError, ParameterError
from revolver_lab.evolution import colliding, live, tendon_paths
from revolver_lab.evolution.alignment import align
from revolver_lab.evolution.cache import Cache
from revolver_lab.evolution.canonical import LISTS, canonical, elements
from revolver_lab.evolution.meshes import align_meshes
from revolver_lab.evolution.padding import pad
from revolver_lab.evolution.ramps import RampSpec
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.survey import read_theta
from revolver_lab.evolution.welds import correspond

if TYPE_CHECKING:
    from dm_control.mujoco import Physics

Robot = str | Path | mujoco.MjSpec

# The paper caches a large number (e.g. 1,000) of robots and draws from them (appendix B).
GRID = 1000
CACHE_BYTES = 256 * 2**20


class Evolution:
    """A continuum of robots from a source, E(0), to a target, E(1).

    Args:
        source: MJCF or URDF, as a path, XML text or MjSpec; a skin, only drawn, is left out.
        target: The same for the target robot.
        f: "linear", "smoothstep", a callable, or patterns over `theta_names` to any of these.
        pins: Source names -> target names that the matching has to respect.
        root: Body of the target to take as its root; by default the best one.
        switch: alpha at which discrete differences switch: one for all, or by name.
        unnamed: "refuse" bodies and joints without a name, or "number" them.
        name: What to call this evolution in logs and cards.
        cache_bytes: Bound on the memory of the cache of compiled robots.

    Raises:
        RobotFileError: If a robot cannot be read.
        MatchingError: If the two cannot be put in correspondence.
        ParameterError: If f is no path from 0 to 1, or discrete attributes differ.

    Example:
        >>> pole = "<mujoco><worldbody><body name='pole'><joint name='hinge' axis='0 1 0'/>"
        >>> pole += "<geom name='rod' type='capsule' fromto='0 0 0 0 0 {}' size='.05'/>"
        >>> pole += "</body></worldbody></mujoco>"
        >>> evolve = Evolution(pole.format(1), pole.format(2))
        >>> float(evolve.model(0.5).geom("rod").size[1])
        0.75
    """

    def __init__(
        self,
        source: Robot,
        target: Robot,
        *,
        f: RampSpec = "linear",
        pins: Mapping[str, str] | None = None,
        root: str | None = None,
        switch: float | Mapping[str, float] | None = None,
        unnamed: str = "refuse",
        name: str | None = None,
        cache_bytes: int = CACHE_BYTES,
    ):
        read = (read_robot(robot, unnamed=unnamed) for robot in (source, target))
        switching = switch is not None
        ours, theirs, self.matching = correspond(*read, pins=pins, root=root, switching=switching)
        padded = pad(ours, theirs, self.matching)
        self.name = name or f"{ours.modelname or 'source'}-to-{theirs.modelname or 'target'}"
        self._spec, there = canonical(padded.source), canonical(padded.target)
        pairs = dict(padded.pairs) | {"option": [("world", "world")]}
        align(self._spec, there, pairs, switching=switching)
        pairs["mesh"] = align_meshes(self._spec, there, pairs)
        self._theta = read_theta(
            self._spec, there, pairs, padded.switches, f=f, switch=switch, held=padded.held
        )
        self._found = {kind: elements(self._spec, kind) for kind in (*LISTS, "wrap", "option")}
        self._cache, self._lock = Cache(cache_bytes), threading.Lock()
        self._made: live.Base | None = None
        self._varying: set[str] = set()
        if self._theta.switches:  # not all that is discrete can change within one layout
            self._arrays(1.0)

    def __repr__(self) -> str:
        changed = int(self._theta.changed.sum())
        return f"Evolution({self.name!r}, {changed} of {len(self.theta_names)} parameters change)"

    def __call__(self, alpha: float) -> "Physics":
        """E(alpha) as a dm_control Physics of its own, at the model's reference pose.

        Args:
            alpha: Evolution parameter in [0, 1].

        Raises:
            AlphaError: If alpha is no number in [0, 1].
        """
        _gl.choose()  # before dm_control is imported, which settles the renderer
        from dm_control.mujoco import Physics, wrapper

        _gl.settle_exit()
        return Physics.from_model(wrapper.MjModel(self.model(alpha)))

    def model(self, alpha: float) -> mujoco.MjModel:
        """E(alpha), compiled; the caller owns it.

        Example:
            >>> import revolver_lab as rvl
            >>> rvl.load("cheetah-front-leg").model(0.3).nbody
            8
        """
        alpha = checked_alpha(alpha)
        model = copy.copy(self._base.model)
        live.write(model, self._arrays(alpha))
        return model

    def theta(self, alpha: float) -> np.ndarray:
        """Kinematic parameters of E(alpha), (D,), in the units that `theta_names` gives.

        Linear in f, and exact at both ends (equation 2). Orientations and axes are rotation
        vectors from the source's, so that linear in theta is slerp in space.
        """
        return self._theta(checked_alpha(alpha))

    @property
    def theta_names(self) -> tuple[str, ...]:
        """Names of the D coordinates of theta, with units: "geom/fshin/size[1] [m]"."""
        return self._theta.names

    @property
    def theta_changed(self) -> np.ndarray:
        """Which coordinates of theta differ between source and target, (D,) bool."""
        return self._theta.changed

    def set_alpha(self, physics: "Physics", alpha: float) -> None:
        """Move an existing Physics to E(alpha); its state and its GL context survive.

        Args:
            physics: What `evolve(...)` returned earlier.
            alpha: Evolution parameter in [0, 1].
        """
        live.move(physics, lambda model: self.write_model(model, alpha))

    def write_model(self, model: mujoco.MjModel, alpha: float) -> set[str]:
        """Move a bare MjModel of this evolution to E(alpha).

        Args:
            model: What `evolve.model(...)` returned earlier; its arrays are overwritten.
            alpha: Evolution parameter in [0, 1].

        Returns:
            Names of the fields that were written.

        Raises:
            ParameterError: If the model is not of this evolution.
        """
        alpha = checked_alpha(alpha)
        if model.signature != self._base.model.signature:
            raise ParameterError(
                "a model of another robot", f"a model of {self!r}", "Make it with evolve.model()."
            )
        for place in (0.5, 1.0) if not self._varying else ():  # the model may come from there
            self._arrays(place)
        arrays, base = self._arrays(alpha), self._base.arrays
        live.write(model, {name: arrays.get(name, base[name]) for name in self._varying})
        return self._varying

    def nearest(self, alpha: float) -> float:
        """The nearest of the cache's grid of 1,001 robots (appendix B).

        Example:
            >>> import revolver_lab as rvl
            >>> rvl.load("cheetah-front-leg").nearest(0.30004)
            0.3
        """
        return round(checked_alpha(alpha) * GRID) / GRID

    @property
    def cache_nbytes(self) -> int:
        """Memory that the cached robots take [bytes]."""
        return self._cache.nbytes

    @property
    def _base(self) -> live.Base:
        with self._lock:
            if self._made is None:  # once, or the second would find no textures
                self._theta.write(0.0, self._spec, self._found)
                awake = live.awake(self._spec, self._compiled, self._theta.attributes)
                self._made = live.Base(awake)
                live.undress(self._spec)
            return self._made

    def _compiled(self) -> mujoco.MjModel:
        """The robot as it is written now."""
        switches = (s for s in self._theta.switches if s.attribute in colliding.COLLIDES)
        geoms = [self._found[kind][name] for kind, name in {s.element for s in switches}]
        wraps = self._found["wrap"]
        return colliding.compiled(geoms, lambda: tendon_paths.compiled(self._spec, wraps))

    def _arrays(self, alpha: float) -> live.Arrays:
        """What distinguishes E(alpha) from E(0), compiled once and remembered."""
        base, cached = self._base, self._cache.get(alpha)
        if cached is not None:
            return cached
        with self._lock:
            self._theta.write(alpha, self._spec, self._found)
            try:
                arrays = base.difference(self._compiled())
            except ValueError as error:
                raise ParameterError(
                    f"E({alpha}), which cannot be: {error}",
                    "two robots between which every robot is legal and has as many of everything",
                    "Change the parameter it names, or give it a ramp of its own; a mesh that "
                    "deforms has to keep the corners and faces of its convex hull.",
                ) from error
        self._varying |= arrays.keys()
        self._cache.put(alpha, arrays)
        return arrays


def checked_alpha(alpha: float) -> float:
    """alpha as a float, if it is one in [0, 1].

    Raises:
        AlphaError: If it is not a number in [0, 1].

    Example:
        >>> checked_alpha(1)
        1.0
    """
    try:
        value = float(alpha)
    except (TypeError, ValueError):
        value = math.nan
    if isinstance(alpha, str) or not 0.0 <= value <= 1.0:
        given = alpha.item() if isinstance(alpha, np.generic) else alpha
        raise AlphaError(f"alpha = {given!r}", "a number in [0, 1]", "Clip it before the call.")
    return value
