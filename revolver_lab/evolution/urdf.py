"""A URDF's text as MuJoCo reads it best: whole paths, and visuals kept where they can be read."""

import contextlib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from revolver_lab.evolution.packages import mesh_file
from revolver_lab.evolution.screening import Screened

BLANK = "\ufeff \t\r\n"
"""What may stand before a file's first element, and MuJoCo does not mind."""

_MESHES = (".stl", ".obj", ".msh")


def with_whole_paths(text: str, path: Path, where: str) -> str:
    """A URDF's text with every mesh by its whole path, once that has been looked at."""
    root = ElementTree.fromstring(text.lstrip(BLANK))
    compiler = root.find("mujoco/compiler")
    settings = {} if compiler is None else compiler.attrib
    strips = settings.pop("strippath", "false") == "true"
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        name = name.rpartition("/")[2] if strips else name
        mesh.set("filename", str(mesh_file(path, name, settings.get("meshdir", ""), where)))
    return ElementTree.tostring(root, encoding="unicode")


def with_compiler_settings(text: str, found: Screened) -> str:
    """A URDF's text with MuJoCo's URDF settings spelled out where it does not set them itself."""
    root = ElementTree.fromstring(text)
    extension = root.find("mujoco")
    if extension is None:
        extension = ElementTree.SubElement(root, "mujoco")
    compiler = extension.find("compiler")
    if compiler is None:
        compiler = ElementTree.SubElement(extension, "compiler")
    _without_idle_inertia(root)
    readable = all(Path(name).suffix.lower() in _MESHES for name in found.visuals)
    settings = {"strippath": "false", "discardvisual": "false" if readable else "true"}
    for name, value in settings.items():
        compiler.set(name, compiler.get(name, value))
    return ElementTree.tostring(root, encoding="unicode")


def _without_idle_inertia(robot: ElementTree.Element) -> None:
    """Drop the inertia of a URDF's root, fixed to the world, where it could not be a body's.

    It is never felt. Quadrupeds often have an empty root with an inertia that is all ones.
    """
    carried = {child.get("link") for child in robot.iterfind("joint/child")}
    for link in robot.iterfind("link"):
        inertial = link.find("inertial")
        inertia = None if inertial is None else inertial.find("inertia")
        if link.get("name") in carried or inertial is None or inertia is None:
            continue
        rows = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
        with contextlib.suppress(ValueError):  # no number, which MuJoCo will say
            tensor = [[float(inertia.get(name, 0)) for name in row] for row in rows]
            if np.linalg.eigvalsh(tensor).min() <= 1e-15:
                link.remove(inertial)
