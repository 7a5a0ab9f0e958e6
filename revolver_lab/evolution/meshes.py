"""Meshes along a path: the same mesh may change its scale, the same topology its vertices."""

import mujoco
import numpy as np

from revolver_lab.errors import ParameterError
from revolver_lab.evolution.canonical import Element, Pairs, elements

# Compiled vertices are single precision: two readings of one file agree to this, relatively.
_TOLERANCE = 1e-5


def align_meshes(
    source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs
) -> list[tuple[str, str]]:
    """Pair the meshes of paired geoms and sites, and give both the same form.

    Where both are the same mesh only its scale moves; where they share their faces both are
    written as vertices, which then move along the path ("continuous mesh deformation",
    section 4.1).

    Args:
        source: A canonical robot, changed in place.
        target: The other one, changed in place.
        pairs: Paired geoms, under "geom", and sites, under "site".

    Returns:
        (mesh name in source, mesh name in target).

    Raises:
        ParameterError: If one mesh would have to become two, or topologies differ.
    """
    paired = _paired_meshes(source, target, pairs)
    if not paired:
        return []
    models = source.compile(), target.compile()
    ours, theirs = elements(source, "mesh"), elements(target, "mesh")
    for name, other in paired.items():
        _align(ours[name], theirs[other], models)
    return list(paired.items())


def _paired_meshes(source: mujoco.MjSpec, target: mujoco.MjSpec, pairs: Pairs) -> dict[str, str]:
    """Source mesh -> target mesh, by the geoms and sites that use them."""
    paired: dict[str, str] = {}
    for kind in ("geom", "site"):
        ours, theirs = elements(source, kind), elements(target, kind)
        for a, b in pairs.get(kind, []):
            mesh, other = ours[a].meshname, theirs[b].meshname
            if bool(mesh) != bool(other):
                raise ParameterError(
                    f"{kind} {a!r}, a mesh in one robot only",
                    "a mesh on both sides, or none",
                    "Give both a mesh with the same faces, or both a primitive.",
                )
            if mesh and paired.setdefault(mesh, other) != other:
                raise ParameterError(
                    f"mesh {mesh!r}, which would become {paired[mesh]!r} and {other!r}",
                    "one target mesh for every source mesh",
                    "Load the source's mesh twice, under two names.",
                )
    return paired


def _align(ours: Element, theirs: Element, models: tuple[mujoco.MjModel, mujoco.MjModel]) -> None:
    """Leave two meshes as they are if only their scale differs, else write their vertices out."""
    (a, faces), (b, other_faces) = (
        _as_written(model, mesh) for model, mesh in zip(models, (ours, theirs))
    )
    if not np.array_equal(faces, other_faces):
        raise ParameterError(
            f"meshes {ours.name!r} and {theirs.name!r} with different faces",
            "meshes that share their topology",
            "Deform one mesh into the other, keeping its faces.",
        )
    if np.array_equal(_corners(models[0], ours.name), _corners(models[1], theirs.name)):
        theirs.maxhullvert = ours.maxhullvert  # neither hull is the less for it
    unscaled = a / np.array(ours.scale), b / np.array(theirs.scale)
    if np.allclose(*unscaled, atol=_TOLERANCE * np.abs(unscaled[0]).max(), rtol=0.0):
        return
    hulls = [_hull(model, mesh.name) for model, mesh in zip(models, (ours, theirs))]
    if hulls[0] != hulls[1]:
        raise ParameterError(
            f"meshes {ours.name!r} and {theirs.name!r}, whose convex hulls have {hulls[0]} and "
            f"{hulls[1]} corners and faces",
            "meshes whose hulls have as many, since MuJoCo lays a model out by them",
            "Deform it less, or collide with primitives: contype='0' conaffinity='0' on its geom.",
        )
    _write_out(ours, a, faces)
    _write_out(theirs, b, faces)


def _as_written(model: mujoco.MjModel, mesh: Element) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) in the frame of the mesh's file, and faces (F, 3), as compiled."""
    view = model.mesh(mesh.name)
    i = view.id
    vertices = slice(model.mesh_vertadr[i], model.mesh_vertadr[i] + model.mesh_vertnum[i])
    faces = slice(model.mesh_faceadr[i], model.mesh_faceadr[i] + model.mesh_facenum[i])
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.mesh_quat[i])
    points = model.mesh_vert[vertices].astype(float) @ rotation.reshape(3, 3).T + model.mesh_pos[i]
    return points, model.mesh_face[faces].copy()


def _hull(model: mujoco.MjModel, name: str) -> tuple[int, int]:
    """Corners and faces of a mesh's convex hull; none where nothing collides with it."""
    at = model.mesh(name).graphadr[0]
    return (0, 0) if at < 0 else tuple(model.mesh_graph[at : at + 2].tolist())


def _corners(model: mujoco.MjModel, name: str) -> np.ndarray:
    """Which vertices of a mesh are corners of its convex hull."""
    count = _hull(model, name)[0]
    first = model.mesh(name).graphadr[0] + 2 + count  # after the counts, and an address for each
    return np.sort(model.mesh_graph[first : first + count])


def _write_out(mesh: Element, points: np.ndarray, faces: np.ndarray) -> None:
    """Replace a mesh's file by its vertices and faces."""
    mesh.file, mesh.scale = "", np.ones(3)
    mesh.refpos, mesh.refquat = np.zeros(3), np.array([1.0, 0, 0, 0])
    mesh.uservert = points.ravel()
    mesh.userface = faces.ravel()
    mesh.usernormal, mesh.usertexcoord = [], []
    mesh.userfacenormal, mesh.userfacetexcoord = [], []
