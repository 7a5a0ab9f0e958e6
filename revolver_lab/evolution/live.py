"""Moving a live model to another alpha: compiled arrays are copied in, geometry is never edited."""

import functools
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from revolver_lab.evolution.parameters import DISCRETE

if TYPE_CHECKING:
    from dm_control.mujoco import Physics

# Names and textures are the source's at every alpha; comparing them would only cost time.
_CONSTANT = {"names", "names_map", "paths", "tex_data", "text_data"}
# Scalars and small arrays that live in the model's structs instead of among its arrays.
_STRUCTS = {
    "opt": ("timestep", "gravity", "wind", "magnetic", "density", "viscosity", "impratio",
            "o_margin", "o_solref", "o_solimp", "o_friction", "sleep_tolerance"),
    "stat": ("center", "extent", "meaninertia", "meanmass", "meansize"),
}  # fmt: skip

Arrays = dict[str, np.ndarray]


@functools.cache
def _array_names() -> tuple[str, ...]:
    """Every array of an MjModel that can differ along a path."""
    probe = mujoco.MjSpec().compile()
    return tuple(
        name
        for name in mujoco.MjModel._all_fields  # the bindings' own list of every field
        if name not in _CONSTANT
        and not name.startswith("name_")
        and isinstance(getattr(probe, name), np.ndarray)
    )


def _struct_fields() -> list[tuple[str, str]]:
    fields = [(struct, name) for struct, names in _STRUCTS.items() for name in names]
    return fields + [("opt", name) for name in DISCRETE["option"]]


# Numbers of what may differ: textures are taken off, and the flags' counts are never looked at.
_COUNTED_ELSEWHERE = ("tex", "names", "paths", "buffer", "gravcomp", "mat")


@functools.cache
def _counts() -> tuple[str, ...]:
    """MuJoCo's names of how many of everything a model has: what its layout is made of."""
    probe = mujoco.MjSpec().compile()
    counts = (n for n in dir(probe) if n.startswith("n") and isinstance(getattr(probe, n), int))
    return tuple(n for n in counts if not n[1:].startswith(_COUNTED_ELSEWHERE))


def read(model: mujoco.MjModel) -> Arrays:
    """Views of everything in a compiled model that can depend on alpha, by field name."""
    arrays: Arrays = {name: getattr(model, name) for name in _array_names()}
    for struct, name in _struct_fields():
        arrays[f"{struct}.{name}"] = np.asarray(getattr(getattr(model, struct), name))
    return arrays


def undress(spec: mujoco.MjSpec) -> None:
    """Take the textures off a robot, which cost a third of the time that compiling it takes.

    They are the source's at every alpha, and E(0) has them.

    Args:
        spec: A robot; its materials stay.
    """
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    for texture in list(spec.textures):
        spec.delete(texture)


def _of_textures(field: str) -> bool:
    """Say whether a field tells of textures and nothing else."""
    return field.startswith("tex_") or field == "mat_texid"


# What MuJoCo does not look at in a model that was compiled with none of it, by kind of element.
_FLAGGED = {"gravcomp": "body", "surfacevel": "geom", "adhesion": "geom"}


def awake(
    spec: mujoco.MjSpec, compiled: Callable[[], mujoco.MjModel], wanted: Collection[str]
) -> mujoco.MjModel:
    """Compiles a robot such that MuJoCo looks at what is 0 here, and is not elsewhere on the path.

    A model's flags are set when it is compiled, and cannot be set again.

    Args:
        spec: The robot; it is left as it was.
        compiled: Compiles it.
        wanted: Attributes of bodies or geoms that are not 0 everywhere on the path.
    """
    model = compiled()
    asleep = [a for a in wanted if a in _FLAGGED and not getattr(model, f"flg_{a}")]
    if not asleep:
        return model
    stirred = []
    for attribute in asleep:
        element = spec.bodies[-1] if _FLAGGED[attribute] == "body" else spec.geoms[-1]
        stirred.append((element, attribute, np.array(getattr(element, attribute))))
        _put(element, attribute, np.ones_like(stirred[-1][2]))
    lending = compiled()
    for element, attribute, value in stirred:
        _put(element, attribute, value)
    write(lending, read(model))
    return lending


def _put(element: Any, attribute: str, value: np.ndarray) -> None:
    """Sets an attribute; MjSpec takes no arrays for what is one number."""
    setattr(element, attribute, value if value.ndim else float(value))


class Base:
    """E(0), as what every other robot of the path is compared with and stored against.

    Args:
        model: E(0), compiled; kept, and never to be written.
    """

    def __init__(self, model: mujoco.MjModel):
        self.model = model
        self.arrays = {n: a for n, a in read(model).items() if a.size and not _of_textures(n)}
        self._bytes = {name: array.tobytes() for name, array in self.arrays.items()}
        self._plain = [name for name in self.arrays if "." not in name]
        self._struct = [name.split(".") for name in self.arrays if "." in name]

    def difference(self, model: mujoco.MjModel) -> Arrays:
        """Copies of the arrays of a model that differ from E(0)'s in any bit.

        Args:
            model: A compiled robot with the layout of E(0); its textures are not looked at.

        Returns:
            Field name -> array; empty for E(0) itself.

        Raises:
            ValueError: If there is more or less of something than in E(0); it is named.
        """
        for name in _counts():
            if getattr(model, name) != getattr(self.model, name):
                raise ValueError(f"it has {name} = {getattr(model, name)}, and E(0) "
                                 f"{getattr(self.model, name)}")  # fmt: skip
        found: Arrays = {}
        for name in self._plain:
            array = getattr(model, name)
            if array.tobytes() != self._bytes[name]:
                found[name] = array.copy()
        for struct, field in self._struct:
            array = np.array(getattr(getattr(model, struct), field))
            if array.tobytes() != self._bytes[f"{struct}.{field}"]:
                found[f"{struct}.{field}"] = array
        return found


def write(model: mujoco.MjModel, fields: Arrays) -> None:
    """Copy compiled arrays into a live model of the same layout.

    Args:
        model: The model to move; it keeps its identity, and with it any GL context.
        fields: Field name -> array, of the shapes that the model has.
    """
    for name, array in fields.items():
        struct, _, attribute = name.rpartition(".")
        if not struct:
            getattr(model, name)[...] = array
        elif array.ndim:
            getattr(getattr(model, struct), attribute)[...] = array
        else:
            setattr(getattr(model, struct), attribute, array.item())


def move(physics: "Physics", write: Callable[[mujoco.MjModel], Collection[str]]) -> None:
    """Change the robot of a Physics in place; its state and its GL context survive.

    Args:
        physics: Made from a model of the same layout.
        write: Writes the model, and says which fields it wrote.
    """
    model, data = physics.model.ptr, physics.data.ptr
    before = model.eq_active0.copy()
    _upload(physics, write(model))
    # What holds is part of the state: where the robot holds otherwise now, the state follows.
    data.eq_active[:] = np.where(before == model.eq_active0, data.eq_active, model.eq_active0)
    mujoco.mj_forward(model, data)


def _upload(physics: "Physics", moved: Collection[str]) -> None:
    """Send moved vertices and terrains to the GPU, if this Physics has ever drawn anything."""
    model = physics.model
    sent = [(mujoco.mjr_uploadMesh, mesh) for mesh in range(model.nmesh) if "mesh_vert" in moved]
    if not {"hfield_data", "hfield_size"}.isdisjoint(moved):
        sent += [(mujoco.mjr_uploadHField, terrain) for terrain in range(model.nhfield)]
    contexts = physics._contexts  # None until the first frame; the property would create them
    if contexts is None or not sent:
        return
    with contexts.gl.make_current() as current:
        for send, which in sent:
            current.call(send, model.ptr, contexts.mujoco.ptr, which)
