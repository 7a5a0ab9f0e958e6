"""Copies meshes, textures, ... from one robot into another, with what their files hold."""

import itertools
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
    elif getattr(donor, "file", ""):
        path = _path(model, kind, donor.name)  # type: ignore[attr-defined]
        whole, held = str(Path(path).resolve()), _held(giver, path)
        if held is None and _held(host, whole) is None:
            copy.file = whole
        else:
            content = Path(whole).read_bytes() if held is None else held
            copy.file = _bring(host, Path(path), content)
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


def _held(spec: mujoco.MjSpec, path: str) -> bytes | None:
    """What MuJoCo takes for a file before it looks on the disk: an asset of the file's name."""
    path = path.lower()
    keys = [key for key in spec.assets if Path(key.lower()).name == Path(path).name]
    best = max(keys, key=lambda key: (path.endswith(key.lower()), len(key)), default=None)
    return None if best is None else spec.assets[best]


def _bring(host: mujoco.MjSpec, file: Path, content: bytes) -> str:
    """Give a robot a file in memory, under a name by which it calls no other file."""
    assets = (*host.meshes, *host.textures, *host.hfields)
    named = {Path(asset.file.lower()).name for asset in assets}
    names = (f"{file.stem}{i if i > 1 else ''}{file.suffix}" for i in itertools.count(1))
    here = next(
        name
        for name in names
        if _held(host, name) == content or (_held(host, name) is None and name.lower() not in named)
    )
    host.assets[here] = content
    return here
