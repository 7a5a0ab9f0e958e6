"""What MuJoCo's compiler leaves out of a robot, left out for good."""

import mujoco


def discard(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Take out what `discardvisual` leaves out, and let the compiler leave out no more.

    With that setting another robot's drawn shapes could not be created in this one.

    Args:
        spec: A robot in which everything has a name, changed in place.
        model: What it compiles to.
    """
    if not spec.compiler.discardvisual:
        return
    for elements, find in (
        (spec.geoms, model.geom), (spec.meshes, model.mesh),
        (spec.materials, model.mat), (spec.textures, model.tex),
    ):  # fmt: skip
        for element in list(elements):
            try:
                find(element.name)
            except KeyError:
                spec.delete(element)
    spec.compiler.discardvisual = False
