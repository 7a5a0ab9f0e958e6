"""What surrounds a robot in its picture: sky, floor and light where its model has none."""

import mujoco
import numpy as np

from revolver_lab.lab import poses

_SUN = np.array([0.3, -0.4, 1.0])
SKY = (0.80, 0.86, 0.93)
GROUND = (0.84, 0.87, 0.91)
LINE = (0.70, 0.74, 0.80)
_GLOW = 20.0
_GRID_LINES = 24
"""Lines each way of the grid on a floor of ours, one every `spacing` metres."""


class Scenery:
    """Adds to a scene what the model lacks, after each mjv_updateScene, and lets no floor end.

    Args:
        model: The robot; only looked at.
        radius: Size of the robot [m], which sets the spacing of the grid.
    """

    def __init__(self, model: mujoco.MjModel, radius: float):
        self._sky = not (model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).any()
        floors = poses.floors(model)
        self._floor = not floors.size
        self._tiles = {
            int(floor): _tile(model, floor)
            for floor in floors
            if (model.geom_size[floor, :2] > 0).all() and _textured(model, floor)
        }
        self._light = model.nlight == 0
        self._radius = radius
        self._spacing = _round_length(radius)

    def add(self, scene: mujoco.MjvScene, centre: np.ndarray, ground: float) -> None:
        """Put sky, floor and light around a robot.

        Args:
            scene: A scene that mjv_updateScene has just filled.
            centre: Where the robot is, (3,) [m].
            ground: Height of a floor of ours [m].
        """
        if self._tiles:
            self._follow(scene, centre)
        if self._sky:
            _backdrop(scene)
        if self._floor:
            self._ground(scene, centre, ground)
        if self._light:
            _sun(scene, centre, 3 * self._radius)

    def _follow(self, scene: mujoco.MjvScene, centre: np.ndarray) -> None:
        """Move floors along under a robot that has come far, by whole tiles of their texture.

        A plane is drawn as large as its size says, and touches without end.
        """
        for geom in scene.geoms[: scene.ngeom]:
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM or geom.objid not in self._tiles:
                continue
            away = (geom.mat.T @ (centre - geom.pos))[:2]
            if (np.abs(away) > geom.size[:2] / 2).any():
                tile = self._tiles[geom.objid]
                geom.pos += geom.mat[:, :2] @ (np.round(away / tile) * tile)

    def _ground(self, scene: mujoco.MjvScene, centre: np.ndarray, height: float) -> None:
        """A floor with a grid that stays put while the camera moves along."""
        step = self._spacing
        x, y = np.round(centre[:2] / step) * step
        half = step * _GRID_LINES / 2
        thin = 0.004 * step
        _geom(scene, mujoco.mjtGeom.mjGEOM_PLANE, (20 * half,) * 2 + (1,), (x, y, height), GROUND)
        for offset in (np.arange(_GRID_LINES + 1) - _GRID_LINES / 2) * step:
            place, long = (x + offset, y, height), (thin, half, thin / 4)
            _geom(scene, mujoco.mjtGeom.mjGEOM_BOX, long, place, LINE)
            place, long = (x, y + offset, height), (half, thin, thin / 4)
            _geom(scene, mujoco.mjtGeom.mjGEOM_BOX, long, place, LINE)


def _textured(model: mujoco.MjModel, floor: int) -> bool:
    """Whether a floor has a texture; without one MuJoCo draws it without end."""
    material = model.geom_matid[floor]
    return material >= 0 and bool((model.mat_texid[material] >= 0).any())


def _tile(model: mujoco.MjModel, floor: int) -> np.ndarray:
    """After which lengths the texture of a floor repeats, (2,) [m]."""
    material = model.geom_matid[floor]
    whole = 1.0 if model.mat_texuniform[material] else 2 * model.geom_size[floor, :2]
    return whole / model.mat_texrepeat[material]


def _round_length(length: float) -> float:
    """The nearest of ..., 0.1, 0.2, 0.5, 1, 2, 5, ... [m].

    Example:
        >>> _round_length(0.45)
        0.5
    """
    steps = np.array([step * 10.0**power for power in range(-3, 4) for step in (1, 2, 5)])
    return float(steps[np.argmin(np.abs(np.log(steps / length)))])


def _geom(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    size: tuple[float, ...],
    place: tuple[float, ...] | np.ndarray,
    colour: tuple[float, ...],
    turn: np.ndarray | None = None,
) -> mujoco.MjvGeom | None:
    """Append one geom to a scene, if there is room for it."""
    if scene.ngeom >= scene.maxgeom:
        return None
    geom = scene.geoms[scene.ngeom]
    turn = np.eye(3) if turn is None else turn
    rgba = np.array([*colour, 1.0], dtype=np.float32)
    mujoco.mjv_initGeom(geom, kind, np.array(size, float), np.array(place), turn.ravel(), rgba)
    geom.specular = 0.0
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR  # decoration casts no shadows
    scene.ngeom += 1
    return geom


def _backdrop(scene: mujoco.MjvScene) -> None:
    """A glowing wall across the view, just before the far end of what the camera sees."""
    camera = scene.camera[0]
    pos, forward, up = (np.array(v, float) for v in (camera.pos, camera.forward, camera.up))
    away = 0.97 * camera.frustum_far
    half = 4 * away * max(camera.frustum_top / camera.frustum_near, 0.1)
    turn = np.stack([np.cross(up, -forward), up, -forward], axis=1)
    size, place = (half, half, 1.0), pos + away * forward
    # A faint wall that glows strongly: its colour then hardly depends on the model's lights.
    faint = tuple(part / _GLOW for part in SKY)
    wall = _geom(scene, mujoco.mjtGeom.mjGEOM_PLANE, size, place, faint, turn)
    if wall is not None:
        wall.emission = _GLOW


def _sun(scene: mujoco.MjvScene, centre: np.ndarray, height: float) -> None:
    """One soft light from above, with a shadow."""
    if scene.nlight >= len(scene.lights):
        return
    light = scene.lights[scene.nlight]
    light.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    light.pos = centre + _SUN * height
    light.dir = -_SUN / np.linalg.norm(_SUN)
    light.diffuse, light.specular, light.ambient = (0.55,) * 3, (0.2,) * 3, (0.1,) * 3
    light.attenuation = (1.0, 0.0, 0.0)
    light.castshadow, light.headlight, light.texid = 1, 0, -1
    light.intensity, light.range, light.bulbradius = 0.0, 10 * height, 0.02
    scene.nlight += 1
