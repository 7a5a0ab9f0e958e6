"""Atomic writing: a file is the old one or the new one, never half of each."""

import contextlib
import json
import os
import tempfile
from pathlib import Path
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.given import require_path


def asset_folder(kind: str) -> Path:
    """Returns the folder of shipped files: the repository's, or the installed package's.

    Args:
        kind: "experts", "frames", ...
    """
    inside = Path(__file__).parent / "assets" / kind
    return inside if inside.is_dir() else Path(__file__).parent.parent / "assets" / kind


def write_atomically(path: str | Path, content: bytes | str) -> Path:
    """Writes a file through a temporary neighbour that is renamed into place.

    A process killed at any moment, or a full disk, leaves what was there before.

    Args:
        path: Where the content goes; folders on the way are made.
        content: The bytes, or text that is encoded as UTF-8.

    Returns:
        The path written.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    data = content.encode() if isinstance(content, str) else content
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)  # mkstemp makes files that only their owner may read
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise
    return path


def output_folder(folder: str | Path) -> Path:
    """Makes a folder for results, before anything is computed that could not be saved there.

    Args:
        folder: Where results are to go.

    Raises:
        SettingsError: If it is no path, has no name, or cannot be made or written to.
    """
    require_path("out", folder)
    if not str(folder):  # Path("") would be the folder one works in
        raise SettingsError("out = '', an empty name", "the name of a folder", "Try out/x.")
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as problem:
        raise SettingsError(
            f"out = {str(folder)!r}, where nothing can be written ({problem.strerror})",
            "a folder that can be made and written to", "Choose another one, for example out/.",
        ) from problem  # fmt: skip


def output_file(path: object, suffix: str = "") -> Path:
    """Returns the path of a file to write, if a file can be called that.

    Args:
        path: As a caller gave it.
        suffix: Put on if it has no ending; a number's decimals are none.

    Raises:
        SettingsError: If it is no path, or the name of a folder.

    Example:
        >>> output_file("out/alpha-0.5", ".npz").name
        'alpha-0.5.npz'
    """
    if not isinstance(path, str | os.PathLike) or not Path(path).name:
        raise SettingsError(f"{path!r} as the name of a file", "a path that ends in a name",
                            f"Try 'out/x{suffix}'.")  # fmt: skip
    named = Path(path)
    if not named.suffix.strip(".0123456789"):
        named = named.with_name(named.name + suffix)
    if named.is_dir() or any(parent.is_file() for parent in named.parents):
        inside = "is a folder" if named.is_dir() else "lies inside a file"
        raise SettingsError(f"{str(named)!r}, which {inside}", "the name of a file",
                            "Choose another name.")  # fmt: skip
    return named


def write_json(path: str | Path, value: Any) -> Path:
    """Writes a value as indented JSON, atomically; a non-finite number becomes null.

    Args:
        path: Where the JSON goes.
        value: Dictionaries, lists, strings, numbers and None.

    Returns:
        The path written.
    """
    return write_atomically(path, json.dumps(_finite(value), indent=2, allow_nan=False) + "\n")


def _finite(value: Any) -> Any:
    """Replaces nan and infinity, which JSON does not have, by None."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value
