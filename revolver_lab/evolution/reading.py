"""Reads a robot from MJCF or URDF into an MjSpec in which everything has a name."""

import difflib
import os
from pathlib import Path

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError, RobotFileError
from revolver_lab.evolution.assets import name_by_content
from revolver_lab.evolution.attached import absorbed
from revolver_lab.evolution.discarding import discard
from revolver_lab.evolution.naming import name_everything
from revolver_lab.evolution.screening import MAX_MODELS, Screened, inside, screen
from revolver_lab.evolution.urdf import BLANK, with_compiler_settings, with_whole_paths

_REMEDIES = {
    "repeated name": "Give every element of a kind a name of its own.",
    "Error opening file": "Put the file where the robot expects it.",
    "mjMINVAL": "Give the body a geom with a mass, or an <inertial>.",
    "Schema violation": "Check the spelling against MuJoCo's XML reference.",
    "'mujocoinclude'": "It is a part of a robot: give the file that includes it.",
    "no decoder found": "Convert it: MuJoCo reads .stl, .obj and .msh.",
    "ASCII file": "Save it as a binary STL.",
    "balanceinertia": "Correct the inertia, or let MuJoCo: balanceinertia='true' in <compiler>, "
    "which a URDF has within <mujoco>.",
    "positive eigenvalues": "Give that body an inertia with three positive principal values.",
    "volume is too small": "Give its body an <inertial>, or close the mesh.",
}


def read_robot(source: str | Path | mujoco.MjSpec, *, unnamed: str = "refuse") -> mujoco.MjSpec:
    """Read a robot and refuse whatever could not evolve.

    A URDF keeps its fixed links as bodies, and its visuals unless their files are of a kind that
    MuJoCo does not read (.dae), in which case all visuals are left out; mesh paths are relative
    to the file, or package:// ones. A path may only lead to files in the robot's folder, or, of a
    URDF, in the ROS package around it; XML text to none at all; an MjSpec is trusted with the
    files that it names. A skin is only drawn, over bodies of one shape, and is left out.

    Args:
        source: Path of an MJCF or URDF file, its XML text, or an MjSpec, which is left as it was.
        unnamed: "refuse" bodies and joints without a name, or "number" them. Geoms, sites,
            actuators, free joints and the like are always named, after their body or joint.

    Returns:
        A private copy in which every element has a name.

    Raises:
        RobotFileError: If the file is missing, malformed, hostile or does not compile.
        ParameterError: If a mass, density or inertia is negative.

    Example:
        >>> box = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
        >>> [geom.name for geom in read_robot(box).geoms]
        ['world_geom']
    """
    if unnamed not in ("refuse", "number"):
        raise RobotFileError(f"unnamed={unnamed!r}", '"refuse" or "number"', "Choose one.")
    if not isinstance(source, str | Path) and isinstance(source, mujoco.MjSpec):
        where = f"the MjSpec {source.modelname!r}"
        spec = source.copy()
    elif isinstance(source, str) and source.lstrip(BLANK).startswith("<"):
        spec, where = _from_text(source), "the XML text"
    elif isinstance(source, str | Path):
        spec, where = _from_path(source), repr(str(source))
    else:
        raise RobotFileError(
            f"a {type(source).__name__}", "a path, XML text or an MjSpec", "Pass one of these."
        )
    for skin in list(spec.skins):
        spec.delete(skin)
    _check_elements(spec, where)
    name_everything(spec, where, unnamed)
    # Of two welded bodies it would make one, for good; without it they move the same.
    spec.compiler.fusestatic = False
    model = _compiled(spec, where)
    _check_numbers(model, where)
    discard(spec, model)
    name_by_content(spec, model)
    return absorbed(spec)


def _from_text(text: str) -> mujoco.MjSpec:
    """Read XML text that names no files, or only package:// ones to be refused."""
    where = "the XML text"
    data = text.lstrip(BLANK).encode()
    found = screen(data, where)
    named = found.includes + found.models + found.files + found.meshes + found.visuals
    for name in named:
        raise RobotFileError(
            f"{where} names the file {name!r}",
            "text that stands alone",
            "Save the text next to its files and pass the path.",
        )
    return _parse(data.decode(), found, where, Path.cwd())


def _from_path(path: str | Path) -> mujoco.MjSpec:
    """Read a file, after everything that it includes, attaches or names has been looked at."""
    path, where = Path(path), repr(str(path))
    data = _read(path, where)
    folder = path.parent.resolve()
    found = screen(data, where)
    _look_around(found, folder, folder, where, [])
    if found.kind == "robot":
        return _parse(with_whole_paths(data.decode(), path, where), found, where, folder)
    try:
        return mujoco.MjSpec.from_file(str(folder / path.name))
    except (ValueError, mujoco.FatalError) as error:
        raise _refusal(error, where) from error


def _look_around(
    found: Screened, home: Path, folder: Path, where: str, attached: list[Path]
) -> None:
    """Screen what a file includes and attaches, and refuse what it names outside a folder.

    Args:
        found: What the file refers to.
        home: The file's own folder, in which links are not followed, as MuJoCo does not.
        folder: The folder that no path may leave.
        where: What to call the file in an error.
        attached: Files of which parts are attached, so far; completed.
    """
    _follow_includes(found, home, folder, where)
    files, folders = found.files, found.folders
    if found.kind == "robot":  # of the robot itself, meshes have been looked for in its package
        files = files + found.meshes + found.visuals if attached else files
        folders = folders if attached else []
    beneath = [os.path.join(base, name) for base in ["", *folders] for name in files]
    for name in folders + beneath:
        _within(folder, home, name, where)
    for model in found.models:
        path = _within(folder, home, model, where)
        attached.append(path)
        if len(attached) > MAX_MODELS:
            raise RobotFileError(
                f"{where} attaches {model!r}, the {len(attached)}th model",
                f"at most {MAX_MODELS} models, none of which attaches itself",
                "Attach fewer.",
            )
        there = repr(str(path))
        _look_around(screen(_read(path, there), there), (home / model).parent, folder, there,
                     attached)  # fmt: skip


def _within(folder: Path, home: Path, name: str, where: str) -> Path:
    """The file that a file in `home` names, refused unless it lies in `folder`."""
    return inside(folder, os.path.join(home, name), where, written=name)


def _read(path: Path, where: str) -> bytes:
    """The bytes of a file that must exist."""
    try:
        if path.is_file():
            return path.read_bytes()
        here = sorted(entry.name for entry in path.parent.iterdir())
    except (OSError, ValueError) as error:
        raise RobotFileError(
            f"{where[:200]} cannot be read ({error})", "a readable file", "Check the path."
        ) from error
    near = difflib.get_close_matches(path.name, here, n=3) or here[:3]
    raise RobotFileError(
        f"{where} is not a file", "the path of an MJCF or URDF file",
        f"Check the path; its folder holds {', '.join(near) or 'nothing'}.",
    )  # fmt: skip


def _follow_includes(found: Screened, home: Path, folder: Path, where: str) -> None:
    """Screen every included file and add what it names to `found`."""
    seen: set[Path] = set()
    waiting = list(found.includes)
    while waiting:
        name = waiting.pop()
        path = _within(folder, home, name, where)
        if path in seen:
            continue
        seen.add(path)
        more = screen(_read(path, repr(str(path))), repr(str(path)))
        waiting += more.includes
        found.files += more.files
        found.folders += more.folders
        # Of all that a file names, only models are looked for beside it when it is included.
        found.models += [os.path.join(os.path.dirname(name), model) for model in more.models]


def _parse(text: str, found: Screened, where: str, folder: Path) -> mujoco.MjSpec:
    """Let MuJoCo parse a screened text whose files are relative to a folder."""
    if found.kind == "robot":
        text = with_compiler_settings(text, found)
    try:
        spec = mujoco.MjSpec.from_string(text)
    except (ValueError, mujoco.FatalError) as error:
        raise _refusal(error, where) from error
    spec.modelfiledir = str(folder)
    return spec


def _refusal(error: Exception, where: str) -> RobotFileError:
    """MuJoCo's complaint, with what to do about it."""
    message = " ".join(str(error).split())
    remedy = next((r for key, r in _REMEDIES.items() if key in message), "Mend it at that place.")
    return RobotFileError(f"{where}: MuJoCo says: {message}", "a robot that compiles", remedy)


def _check_elements(spec: mujoco.MjSpec, where: str) -> None:
    """Refuse what has no counterpart in a tree of bodies, and negative masses."""
    found = {"plugin": spec.plugins, "flex": spec.flexes}
    for kind, elements in found.items():
        if len(elements):
            raise RobotFileError(
                f"{where} has a {kind}", "rigid bodies with joints", f"Remove the {kind}."
            )
    for element in [*spec.bodies, *spec.geoms]:
        density = getattr(element, "density", 0.0)
        if element.mass < 0 or density < 0 or np.min(getattr(element, "inertia", 0.0)) < 0:
            raise ParameterError(
                f"{where} has {element.name or 'an element'!r} of mass {element.mass:g} and "
                f"density {density:g}", "a mass, density or inertia >= 0", "Make it positive.",
            )  # fmt: skip


def _compiled(spec: mujoco.MjSpec, where: str) -> mujoco.MjModel:
    """Compile the robot as it will be compiled later, so that it fails here if it has to."""
    try:
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise _refusal(error, where) from error


def _check_numbers(model: mujoco.MjModel, where: str) -> None:
    """Refuse a robot whose frames, masses or joints are not finite numbers."""
    names = ["qpos0", "dof_armature", "dof_damping", "jnt_stiffness"]
    names += [n for n in dir(model) if n.startswith("body_") or n.endswith(("_pos", "_quat"))]
    for name in names:
        values = np.asarray(getattr(model, name))
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise RobotFileError(
                f"{where} compiles to {name} with a number that is not finite",
                "finite numbers",
                f"Look for the element that sets {name}.",
            )
