"""The one way to a picture: alpha -> cached arrays -> one live model -> one GL context -> array."""

import copy
from typing import Protocol, runtime_checkable

import mujoco
import numpy as np

from revolver_lab.errors import SettingsError, UnknownNameError
from revolver_lab.lab import gl, poses
from revolver_lab.lab.cameras import checked_size, fitted
from revolver_lab.lab.scenery import Scenery

FIT = "fit"
"""Name of the camera that is fitted to the robot and follows it; a model may bring its own."""

_MAX_GEOMS = 10_000
_POSES = 128  # remembered for a slider of 101 values


@runtime_checkable
class Movable(Protocol):
    """What a stage needs of an Evolution: a model at alpha, and moving it to another alpha."""

    def model(self, alpha: float) -> mujoco.MjModel:
        """A model of its own at alpha."""
        ...

    def write_model(self, model: mujoco.MjModel, alpha: float) -> set[str]:
        """Move such a model to another alpha; returns the names of the fields written."""
        ...


class Stage:
    """One live robot under one GL context, which every picture of this package comes from.

    Args:
        robot: An Evolution, or a single MjModel (then alpha is not used).
        width: Width of a frame [pixels].
        height: Height of a frame [pixels].
        camera: Name or id of a camera of the model, or "fit": one that shows the whole robot and
            follows it.
        shadows: Side of the shadow map [pixels]; 0 draws no shadows. Software GL spends most of a
            frame on it at MuJoCo's own 4096.
        samples: Samples per pixel against jagged edges.

    Raises:
        MissingExtraError: If no OpenGL works here.
        SettingsError: If the size is not drawable.
        UnknownNameError: If the model has no such camera.
    """

    def __init__(
        self,
        robot: Movable | mujoco.MjModel,
        *,
        width: int = 480,
        height: int = 360,
        camera: str | int = FIT,
        shadows: int = 1024,
        samples: int = 4,
    ):
        self._evolve = None if isinstance(robot, mujoco.MjModel) else robot
        self.model = robot.model(0.0) if isinstance(robot, Movable) else copy.copy(robot)
        self.data = mujoco.MjData(self.model)
        self._places = self.data.mocap_pos.copy()
        self.alpha = 0.0
        self._poses: dict[float, np.ndarray] = {}
        self._size = checked_size(width, height)
        self._camera = camera
        self._box = self._extent()
        self._find_camera(camera)
        self._scenery = Scenery(self.model, float(np.linalg.norm(np.ptp(self._box, axis=0))) / 2)
        self._open(shadows, samples)

    def _open(self, shadows: int, samples: int) -> None:
        """Make the context and upload the model to it, once."""
        width, height = self._size
        quality, buffer = self.model.vis.quality, self.model.vis.global_
        quality.shadowsize, quality.offsamples = shadows, samples
        buffer.offwidth, buffer.offheight = width, height
        self._context = gl.Context(width, height)
        with self._context:
            self._drawing = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._drawing)
        self._context.on_free(self._drawing.free)
        self._scene = mujoco.MjvScene(self.model, _MAX_GEOMS)
        self._shadows = shadows > 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = self._shadows
        self._scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = False  # it glows around endless floors
        self._option = mujoco.MjvOption()
        self._uploaded = _shape_of_meshes(self.model)

    def frame(
        self,
        alpha: float | None = None,
        qpos: np.ndarray | None = None,
        camera: str | int | None = None,
        places: np.ndarray | None = None,
    ) -> np.ndarray:
        """Draw the robot.

        Args:
            alpha: Evolution parameter in [0, 1]; by default the robot stays as it is.
            qpos: Pose, (nq,); by default the robot stands on the floor.
            camera: Another camera than the stage's.
            places: Of the mocap bodies, (nmocap, 3) [m]; by default where the model has them.

        Returns:
            Picture, (height, width, 3) uint8.

        Raises:
            AlphaError: If alpha is outside [0, 1].
            SettingsError: If qpos has another size.
            UnknownNameError: If the model has no such camera.
        """
        self.move(alpha, qpos, places)
        return self._draw(self._find_camera(self._camera if camera is None else camera))

    def move(
        self,
        alpha: float | None = None,
        qpos: np.ndarray | None = None,
        places: np.ndarray | None = None,
    ) -> None:
        """Bring the live model to alpha and its data to qpos and places, without drawing."""
        if alpha is not None and self._evolve is not None and alpha != self.alpha:
            self._evolve.write_model(self.model, alpha)
            self.alpha = alpha
        self._widen_floors()
        pose = self._standing() if qpos is None else np.asarray(qpos, float)
        if pose.shape != (self.model.nq,):
            raise SettingsError(
                f"qpos of shape {pose.shape}", f"({self.model.nq},)", "Record it on this robot."
            )
        self.data.qpos[:] = pose
        self.data.mocap_pos[:] = self._places if places is None else places
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        mujoco.mj_tendon(self.model, self.data)

    def _standing(self) -> np.ndarray:
        """The pose to stand in at this alpha; a slider comes back to the same few."""
        if self.alpha not in self._poses:
            while len(self._poses) >= _POSES:
                self._poses.pop(next(iter(self._poses)))
            self._poses[self.alpha] = poses.standing(self.model)
        return self._poses[self.alpha]

    def _widen_floors(self) -> None:
        """Make finite floors endless, where that stretches no texture."""
        model = self.model
        for floor in poses.floors(model):
            material = model.geom_matid[floor]
            if material < 0 or model.mat_texuniform[material]:
                model.geom_size[floor, :2] = 0.0

    def resize(self, width: int, height: int) -> None:
        """Draw at another size from now on, in the same context."""
        self._size = checked_size(width, height)
        if width > self._drawing.offWidth or height > self._drawing.offHeight:
            with self._context:
                mujoco.mjr_resizeOffscreen(width, height, self._drawing)

    def effects(self, shown: bool) -> None:
        """Draw shadows and reflections, or not; software GL spends half of a frame on them."""
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = shown
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shown and self._shadows

    def close(self) -> None:
        """Free the context now, instead of at exit; frames cannot be drawn afterwards."""
        self._context.free()

    def __enter__(self) -> "Stage":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _draw(self, camera: mujoco.MjvCamera) -> np.ndarray:
        """Fill the scene, render it and read the pixels back, top row first."""
        width, height = self._size
        every = mujoco.mjtCatBit.mjCAT_ALL.value
        scene, rect = self._scene, mujoco.MjrRect(0, 0, width, height)
        # First the camera: endless floors are centred on where the scene last had it.
        mujoco.mjv_updateCamera(self.model, self.data, camera, scene)
        mujoco.mjv_updateScene(self.model, self.data, self._option, None, camera, every, scene)
        self._scenery.add(scene, self._where(), min(0.0, self._box[0, 2]))
        upside_down = np.empty((height, width, 3), dtype=np.uint8)
        with self._context:
            self._upload()
            mujoco.mjr_render(rect, scene, self._drawing)
            mujoco.mjr_readPixels(upside_down, None, rect, self._drawing)
        return np.ascontiguousarray(upside_down[::-1])

    def _upload(self) -> None:
        """Tell the context what depends on alpha: extents, and meshes whose vertices moved."""
        extent, limits = self.model.stat.extent, self.model.vis.map
        self._drawing.shadowClip = limits.shadowclip * extent
        self._drawing.fogStart, self._drawing.fogEnd = (
            limits.fogstart * extent, limits.fogend * extent,
        )  # fmt: skip
        now = _shape_of_meshes(self.model)
        for mesh, (before, after) in enumerate(zip(self._uploaded, now, strict=True)):
            if not np.array_equal(before, after):
                mujoco.mjr_uploadMesh(self.model, self._drawing, mesh)
                self._uploaded[mesh] = after

    def _find_camera(self, camera: str | int) -> mujoco.MjvCamera:
        """The model's camera of that name or id, or the fitted one."""
        names = [self.model.camera(i).name for i in range(self.model.ncam)]
        if camera == FIT and FIT not in names:
            return fitted(self.model, self._box, self._size, self._where() - self._start)
        index = names.index(camera) if camera in names else camera
        if not isinstance(index, int) or not 0 <= index < self.model.ncam:
            choices = ", ".join([repr(name) for name in names] + [repr(FIT)])
            raise UnknownNameError(f"camera {camera!r}", choices, "Name one of them.")
        found = mujoco.MjvCamera()
        found.type, found.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, index
        return found

    def _where(self) -> np.ndarray:
        """Centre of mass of everything that moves, (3,) [m]."""
        return self.data.subtree_com[0]

    def _extent(self) -> np.ndarray:
        """Corners of a box that holds the standing robot at alpha 0 and at 1, (2, 3) [m]."""
        corners = []
        for alpha in (1.0, 0.0):
            self.move(alpha)
            corners += poses.box(self.model, self.data)
        self._start = self._where().copy()
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        return np.stack([low, np.maximum(high, low + 1e-3)])


def _shape_of_meshes(model: mujoco.MjModel) -> list[np.ndarray]:
    """Copies of each mesh's vertices, (n, 3)."""
    counts = zip(model.mesh_vertadr, model.mesh_vertnum, strict=True)
    return [model.mesh_vert[first : first + count].copy() for first, count in counts]
