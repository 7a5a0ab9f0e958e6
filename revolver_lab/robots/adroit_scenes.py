"""The Adroit hand in its three scenes, read from gymnasium-robotics and drawn as it collides."""

import mujoco

from revolver_lab.evolution.naming import name_everything
from revolver_lab.robots.installed import installed_spec

PACKAGE = "gymnasium_robotics"
FOLDER = "envs/assets/adroit_hand"

LOST = ("mf", "rf", "lf")
"""What the names of the middle, ring and little finger begin with."""

SKIN, FADING, CLOTH = (0.87, 0.67, 0.53, 1.0), (0.45, 0.62, 0.80, 1.0), (0.35, 0.37, 0.42, 1.0)
"""Colours of what stays, of the three fingers that go, and of the arm."""
SLEEVE = (0.0, 0.0, 0.02, 0.0, 0.0, 0.30)
"""Ends of the capsule that is drawn as forearm; it collides with nothing [m]."""
SLEEVE_RADIUS = 0.042

#        scene: body or site that stands elsewhere in every episode, and the middle of where [m]
MOVED = {
    "hammer": ("nail_board", (0.05, 0.0, 0.175)),
    "relocate": ("target", (0.0, 0.0, 0.25)),
    "door": ("frame", (-0.25, 0.3, 0.301)),
}
CAMERA = "fit"
"""Its name makes it the camera of pictures and films, in place of the one fitted to a robot."""
#          scene: place of the camera, where it looks [m], and how wide [degrees]
CAMERAS = {
    "hammer": ((0.5, -0.46, 0.7), (0.0, -0.13, 0.16), 33),
    "relocate": ((0.55, -0.4, 0.75), (0.0, -0.07, 0.16), 38),
    "door": ((-0.3, -0.66, 0.82), (0.09, -0.03, 0.2), 44),
}
SHADOWED = 0.2
"""Share of the lamp's cone that has shadows, which is about the table: so their edges are sharp."""


def adroit(scene: str) -> mujoco.MjSpec:
    """Return the hand in one of its scenes, everything named.

    Physics is gymnasium-robotics' own, but for two things of form. What stands elsewhere in every
    episode hangs on a mocap body: its place is then part of a simulation's state, and not of the
    robot. And the meshes, which collide with nothing, are gone: what collides is drawn, so that a
    picture shows what touches what. (They also cost 12 ms a compile instead of 2, and 2.7 MB a
    remembered robot instead of 11 kB.)

    Args:
        scene: "hammer", "relocate" or "door".

    Raises:
        MissingExtraError: If gymnasium-robotics is not installed.
    """
    spec = installed_spec(PACKAGE, f"{FOLDER}/adroit_{scene}.xml")
    name_everything(spec, scene)
    _hang_on_mocap(spec, *MOVED[scene])
    _draw_what_collides(spec)
    _drop_unused_assets(spec)
    spec.visual.map.shadowscale = SHADOWED
    _add_camera(spec, *CAMERAS[scene])
    return spec


def _hang_on_mocap(spec: mujoco.MjSpec, name: str, place: tuple[float, ...]) -> None:
    """Make a body of the world, or a new one that carries a site of the world, a mocap body."""
    site = spec.site(name)
    if site is None:
        spec.body(name).mocap, spec.body(name).pos = True, place
        return
    goal = spec.worldbody.add_body(name="goal", mocap=True, pos=place)
    shape = {"type": site.type, "size": site.size, "rgba": site.rgba}
    spec.delete(site)
    goal.add_site(name=name, **shape)


def _draw_what_collides(spec: mujoco.MjSpec) -> None:
    """Replace the hand's meshes by its collision shapes, and the forearm's by a capsule."""
    for geom in [g for g in spec.geoms if g.meshname]:
        spec.delete(geom)
    for name, rgba in (("skin", SKIN), ("fading", FADING), ("cloth", CLOTH)):
        spec.add_material(name=name, rgba=rgba, specular=0.2, shininess=0.2)
    for geom in spec.geoms:
        if geom.name.startswith("C_"):
            fades = geom.name[2:4] in LOST
            geom.material = "fading" if fades else "cloth" if "arm" in geom.name else "skin"
            geom.group, geom.rgba = 1, [0.5, 0.5, 0.5, 1]  # grey: MuJoCo then asks the material
    sleeve = spec.body("forearm").add_geom(name="V_sleeve", material="cloth", group=1)
    sleeve.type, sleeve.fromto = mujoco.mjtGeom.mjGEOM_CAPSULE, SLEEVE
    sleeve.size = [SLEEVE_RADIUS, 0, 0]
    sleeve.contype = sleeve.conaffinity = 0


def _drop_unused_assets(spec: mujoco.MjSpec) -> None:
    """Remove meshes, materials and textures that nothing is drawn with: every copy carries them."""
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    drawn = {element.material for element in (*spec.geoms, *spec.sites)}
    for material in list(spec.materials):
        if material.name not in drawn:
            spec.delete(material)
    worn = {name for material in spec.materials for name in material.textures}
    for texture in list(spec.textures):
        if texture.name not in worn:
            spec.delete(texture)


def _add_camera(
    spec: mujoco.MjSpec, place: tuple[float, ...], point: tuple[float, ...], wide: float
) -> None:
    """Add the camera that pictures are taken by, at a place of the world, looking at a point."""
    look = spec.worldbody.add_body(name="camera_aim", pos=point)
    camera = spec.worldbody.add_camera(name=CAMERA, pos=place, fovy=wide)
    camera.mode, camera.targetbody = mujoco.mjtCamLight.mjCAMLIGHT_TARGETBODY, look.name
