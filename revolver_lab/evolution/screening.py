"""Screens the text of a robot file before MuJoCo's parser, written in C, is let near it."""

import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from revolver_lab.errors import ParameterError, RobotFileError

MAX_BYTES = 32 * 2**20
MAX_DEPTH = 128
MAX_ELEMENTS = 100_000
MAX_COPIES = 10_000
MAX_MODELS = 100
# Attributes that make MuJoCo allocate or loop as often as they say, and how far they may go.
_COUNTS = {
    "nrow": 4096, "ncol": 4096, "width": 8192, "height": 8192, "njmax": 10**6, "nconmax": 10**6,
    "nuserdata": 10**6, "nkey": 10**5, "nstack": 10**8, "octree_maxdepth": 8, "resolution": 8192,
    "nsample": 10**5,
}  # fmt: skip
# Elements that run code of others, or whose state has no counterpart in a tree of bodies.
_UNSUPPORTED = ("plugin", "flex", "flexcomp", "composite", "extension")
_NAMES = {
    "name", "class", "childclass", "file", "filename", "content_type", "model", "body", "joint",
    "geom", "site", "mesh", "material", "texture", "tendon", "target", "actuator", "text", "data",
    "prefix", "link", "rgba",
}  # fmt: skip
_FOLDERS = ("meshdir", "texturedir", "assetdir")
_MASSES = ("mass", "density", "diaginertia", "massscale")


@dataclass
class Screened:
    """What a screened text refers to.

    Attributes:
        kind: The name of its first element, "mujoco" or "robot" (URDF).
        includes: Files that it includes, as written.
        models: Robots of which it attaches parts, as written.
        files: Other files that it names, as written.
        folders: Asset folders that it sets, as written.
        meshes: Mesh files with which a URDF collides, as written.
        visuals: Those that it only draws.
    """

    kind: str = ""
    includes: list[str] = field(default_factory=list)
    models: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    folders: list[str] = field(default_factory=list)
    meshes: list[str] = field(default_factory=list)
    visuals: list[str] = field(default_factory=list)


def screen(text: bytes, where: str) -> Screened:
    """Refuse a text that is not a plain robot file, and list what it refers to.

    Args:
        text: The file's bytes.
        where: What to call it in an error.

    Raises:
        RobotFileError: If it is empty, too large, too deep, not XML, declares entities, asks for
            unreasonable sizes, holds a number that is not finite, or uses plugins or flexes.
        ParameterError: If a mass, density or inertia is negative.
    """
    if not text.strip():
        raise RobotFileError(f"{where} is empty", "an MJCF or URDF robot", "Give the robot's XML.")
    if len(text) > MAX_BYTES:
        raise RobotFileError(
            f"{where} has {len(text)} bytes",
            f"at most {MAX_BYTES} bytes of XML",
            "Keep meshes in files of their own.",
        )
    reader = _Reader(where)
    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = reader.doctype
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    try:
        parser.Parse(text.lstrip(), True)
    except (RobotFileError, ParameterError):
        raise
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise RobotFileError(
            f"{where} is not well-formed XML ({error})", "MJCF or URDF", "Mend it at that place."
        ) from error
    if reader.found.kind not in ("mujoco", "mujocoinclude", "robot"):
        raise RobotFileError(
            f"{where} starts with <{reader.found.kind}>",
            "<mujoco> (MJCF) or <robot> (URDF)",
            "Convert the robot to one of the two.",
        )
    return reader.found


class _Reader:
    """Walks the elements of one text and keeps count."""

    def __init__(self, where: str):
        self.found, self._where = Screened(), where
        self._path: list[str] = []
        self._copies: list[int] = []
        self._elements = 0

    def doctype(self, name: str, *_: object) -> None:
        """Refuse entity declarations: they can grow without bound or read other files."""
        raise RobotFileError(
            f"{self._where} declares a DOCTYPE", "plain XML", "Remove the declaration."
        )

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Check one element on the way in."""
        self.found.kind = self.found.kind or tag
        self._path.append(tag)
        self._elements += 1
        self._copies.append(_whole(attributes.get("count")) if tag == "replicate" else 1)
        self._check_size()
        if tag in _UNSUPPORTED and self.found.kind != "robot":
            raise RobotFileError(
                f"{self._where} uses <{tag}>",
                "rigid bodies, joints, geoms, sites, tendons and actuators",
                f"Remove the <{tag}> element.",
            )
        if tag.startswith("xacro:"):
            raise RobotFileError(
                f"{self._where} uses <{tag}>", "URDF whose macros have been expanded",
                "Expand them first: xacro robot.xacro > robot.urdf.",
            )  # fmt: skip
        for name, value in attributes.items():
            self._check_number(tag, name, value)
        self._collect(tag, attributes)

    def end(self, tag: str) -> None:
        """Leave one element."""
        self._path.pop()
        self._copies.pop()

    def _check_size(self) -> None:
        """Refuse what would exhaust the parser's stack or the memory."""
        found = {
            f"elements nested {len(self._path)} deep": (len(self._path), MAX_DEPTH),
            f"{self._elements} elements": (self._elements, MAX_ELEMENTS),
            f"{math.prod(self._copies)} replicated copies": (math.prod(self._copies), MAX_COPIES),
        }
        for given, (value, most) in found.items():
            if value > most:
                raise RobotFileError(
                    f"{self._where} has {given}", f"at most {most}", "Make it smaller."
                )

    def _check_number(self, tag: str, name: str, value: str) -> None:
        """Refuse numbers that are not finite, negative masses and absurd sizes."""
        if name in _NAMES and name != "rgba":
            return
        numbers = _numbers(value)
        given = f'{self._where} has {name}="{value[:60]}" in <{tag}>'
        if not all(math.isfinite(number) for number in numbers):
            raise RobotFileError(given, "finite numbers", "Write a number there.")
        negative = any(number < 0 for number in numbers)
        if negative and (name in _MASSES or (tag, name) == ("mass", "value")):
            raise ParameterError(given, "a mass, density or inertia >= 0", "Make it positive.")
        if name in _COUNTS and any(number > _COUNTS[name] for number in numbers):
            raise RobotFileError(given, f"at most {_COUNTS[name]}", "Make it smaller.")
        if name == "memory" and (numbers[:1] > [2.0**32] or value.strip()[-1:] in "TPEtpe"):
            raise RobotFileError(given, "at most 4 GiB", "Leave the memory to MuJoCo.")

    def _collect(self, tag: str, attributes: dict[str, str]) -> None:
        """Note the files and folders that an element names."""
        self.found.folders += [attributes[name] for name in _FOLDERS if name in attributes]
        for name, value in attributes.items():
            if name == "filename" and tag == "mesh":
                drawn = "visual" in self._path
                (self.found.visuals if drawn else self.found.meshes).append(value)
            elif name == "file":
                found = {"include": self.found.includes, "model": self.found.models}
                found.get(tag, self.found.files).append(value)
            elif name.startswith("file"):
                self.found.files.append(value)


def _whole(text: str | None) -> int:
    """A count as written, 1 where there is none."""
    try:
        return max(1, int(text or 1))
    except ValueError:
        return 1


def _numbers(text: str) -> list[float]:
    """The numbers of an attribute, [] where it is not a list of numbers."""
    try:
        return [float(token) for token in text.split()]
    except ValueError:
        return []


def inside(folder: Path, name: str, where: str, written: str | None = None) -> Path:
    """The file that a robot names, refused unless it lies in the robot's own folder.

    Args:
        folder: The robot's folder, with links resolved.
        name: The file in that folder.
        where: What to call the robot in an error.
        written: The file as the robot names it, if otherwise.

    Raises:
        RobotFileError: If, links followed, the path leaves the folder.
    """
    written = name if written is None else written
    if "://" in name or "\\" in name or "\0" in name:
        raise RobotFileError(
            f"{where} names {written!r}",
            "a path relative to the robot's file, with forward slashes",
            "Write the path without any scheme.",
        )
    path = Path(os.path.normpath(folder / name)).resolve()  # MuJoCo, too, takes out ".." first
    if not path.is_relative_to(folder):
        raise RobotFileError(
            f"{where} names {written!r}, outside its folder {str(folder)!r}",
            "files in the robot's folder and beneath",
            "Copy the file there, or load it with mujoco.MjSpec.from_file and pass the MjSpec.",
        )
    return path
