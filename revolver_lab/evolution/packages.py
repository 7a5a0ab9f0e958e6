"""Finds the folder of the ROS package that a URDF belongs to, and the files it names there."""

from pathlib import Path
from xml.etree import ElementTree

from revolver_lab.errors import RobotFileError
from revolver_lab.evolution.screening import inside

SCHEME = "package://"
MANIFEST = "package.xml"
_LEVELS = 4  # folders above a file that may be its package: NAME/robots/ROBOT/urdf/robot.urdf


def package_folder(path: Path, name: str | None = None) -> Path | None:
    """Returns the package's folder around a file, with links resolved; None if there is none.

    Args:
        path: The robot's file.
        name: The package: what its manifest calls it, or the name of its folder, as the two may
            differ. None takes the nearest folder with a manifest.

    Example:
        >>> package_folder(Path("robot.urdf"), "no_such_package") is None
        True
    """
    for folder in path.resolve().parents[:_LEVELS]:
        called = _called(folder / MANIFEST)
        if called is not None if name is None else name in (called, folder.name):
            return folder
    return None


def _called(manifest: Path) -> str | None:
    """What a package's manifest calls it; None where there is no manifest to be read."""
    if not manifest.is_file():
        return None
    try:
        root = ElementTree.fromstring(manifest.read_bytes())
    except (OSError, ElementTree.ParseError):
        return None
    return (root.findtext("name") or "").strip() if root.tag == "package" else None


def mesh_file(path: Path, name: str, meshdir: str, where: str) -> Path:
    """Returns where a mesh of a URDF is: in the robot's package, or in its folder.

    Args:
        path: The robot's file.
        name: As written: "package://NAME/meshes/link.stl", where NAME may also be a folder beside
            the robot's file, or relative to that file.
        meshdir: The folder before a relative name, as MuJoCo's compiler element has it.
        where: What to call the robot in an error.

    Raises:
        RobotFileError: If the robot is in no package of that name, or the mesh lies outside.
    """
    if not name.startswith(SCHEME):
        folder = path.parent.resolve()
        file = folder / meshdir / name
        inside(package_folder(path) or folder, name if "://" in name else str(file), where, name)
        return file
    package, _, rest = name.removeprefix(SCHEME).lstrip("/").partition("/")
    folder = package_folder(path, package) if package else None
    beside = path.parent.resolve() / package
    if folder is None and package and beside.is_dir():  # some write the path from their folder so
        inside(path.parent.resolve(), str(beside), where, name)
        folder = beside
    if folder is None:
        raise RobotFileError(
            f"{where} names {name!r}",
            f"a file of a package that holds the robot: a folder {package!r} around it or beside "
            f"it, or one whose {MANIFEST} gives that name",
            "Put the robot into its package, or write the path relative to it, without package://.",
        )
    inside(folder, rest, where, name)
    return folder / rest
