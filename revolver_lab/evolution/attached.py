"""What was attached to a robot, made a part of it like any other."""

import mujoco

from revolver_lab.evolution.canonical import canonical
from revolver_lab.evolution.inertias import infer_alike, state_inertia, stop_inferring
from revolver_lab.evolution.rebuilding import add_whole_body, rebuilt


def absorbed(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The same robot, with one rule by which inertias are found.

    MuJoCo lets what was attached keep the compiler of its own file, and every copy of a robot
    shares that one, so that it cannot be written over. Where it infers inertias by a rule of its
    own, or of both, all of them are stated and the bodies built anew.

    Args:
        spec: A robot in which everything has a name; it is left as it was.

    Returns:
        The robot, or itself where nothing attached has a rule of its own.
    """
    rules = spec.compiler, mujoco.MjSpec().compiler
    attached = [body.compiler for body in spec.bodies if body.compiler != spec.compiler]
    if all(infer_alike(compiler, rule) for compiler in attached for rule in rules):
        return spec
    model = spec.compile()
    host = rebuilt(canonical(spec), _hang)
    for body in host.bodies[1:]:
        state_inertia(body, model)
    stop_inferring(host.compiler)
    return host


def _hang(here: mujoco.MjsBody, body: mujoco.MjsBody) -> None:
    """Hang a copy of a body with all below it."""
    copy = add_whole_body(here, body)
    for child in body.bodies:
        _hang(copy, child)
