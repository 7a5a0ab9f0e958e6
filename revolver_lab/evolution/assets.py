"""Copies meshes, textures, ... from one robot into another, with what their files hold."""

import hashlib
from collections.abc import Collection
from pathlib import Path

import mujoco

from revolver_lab.evolution.copying import copy_attributes


def copy_asset(
    host: mujoco.MjSpec,
    giver: mujoco.MjSpec,
    model: mujoco.MjModel,
    kind: str,
    donor: object,
    name: str,
):
    """Add a copy of a mesh, material, texture or height field, with what its file holds.

    Args:
        host: Where to.
        giver: The robot that has it.
        model: The giver, compiled.
        kind: "mesh", "material", "texture" or "hfield".
        donor: What to copy.
        name: The copy's name.

    Returns:
        The copy.
    """
    copy = getattr(host, f"add_{kind}")(name=name)
    copy_attributes(donor, copy)
    if kind == "texture" and any(donor.cubefiles):  # type: ignore[attr-defined]
        _copy_pixels(copy, model, donor.name)  # type: ignore[attr-defined]
    elif file := getattr(donor, "file", ""):
        if file in giver.assets:
            host.assets[file] = giver.assets[file]
        else:
            path = _path(model, kind, donor.name)  # type: ignore[attr-defined]
            copy.file = str(Path(path).resolve())
    return copy


def _copy_pixels(copy: mujoco.MjsTexture, model: mujoco.MjModel, name: str) -> None:
    """Give a texture the pixels of a compiled one, in place of the files they came from."""
    view = model.tex(name)
    for size in ("width", "height", "nchannel"):
        setattr(copy, size, int(getattr(view, size)[0]))
    first = int(view.adr[0])
    pixels = model.tex_data[first : first + copy.width * copy.height * copy.nchannel]
    copy.data, copy.cubefiles = pixels.tobytes(), [""] * len(copy.cubefiles)
    copy.hflip = copy.vflip = False


def _path(model: mujoco.MjModel, kind: str, name: str) -> str:
    """Where the compiler found an asset's file: an attached robot has folders of its own."""
    short = {"texture": "tex"}.get(kind, kind)
    at = getattr(model, f"{short}_pathadr")[getattr(model, short)(name).id]
    return model.paths[at:].split(b"\0", 1)[0].decode()


def name_by_content(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Name a robot's files in memory by what is in them, and forget those that it does not use.

    MuJoCo takes a file in memory for any of that name, also on the disk, and what it remembers of
    another robot's for it.

    Args:
        spec: A robot in which everything has a name, changed in place.
        model: What it compiles to.
    """
    if not spec.assets:
        return
    kept: dict[str, bytes] = {}

    def named(path: str) -> str | None:
        """The new name of the file in memory that MuJoCo takes for a path, if there is one."""
        key = _taken(spec.assets, path)
        if key is None:
            return None
        content, file = spec.assets[key], Path(key)
        name = f"{file.stem}-{hashlib.sha256(content).hexdigest()[:16]}{file.suffix}"
        kept[name] = content
        return name

    for kind, group in (
        ("mesh", spec.meshes),
        ("texture", spec.textures),
        ("hfield", spec.hfields),
    ):
        for asset in group:
            if asset.file:
                asset.file = named(_path(model, kind, asset.name)) or asset.file
    for texture in spec.textures:
        texture.cubefiles = [(file and named(file)) or file for file in texture.cubefiles]
    spec.assets.clear()
    spec.assets.update(kept)


def _taken(assets: Collection[str], path: str) -> str | None:
    """Which of the files in memory MuJoCo takes for a path: one of its name, wherever it is."""
    path = path.lower()
    keys = [key for key in assets if Path(key.lower()).name == Path(path).name]
    return max(keys, key=lambda key: (path.endswith(key.lower()), len(key)), default=None)
