"""What a robot's theta consists of: every continuous attribute of every element, with its unit."""

from dataclasses import dataclass

# How an attribute moves along f: "linear" in its numbers; "rotation" and "direction" along the
# shortest arc, with the rotation vector from the source as its coordinate in theta.
LINEAR, ROTATION, DIRECTION = "linear", "rotation", "direction"


@dataclass(frozen=True)
class Parameter:
    """One continuous attribute of one kind of element.

    Attributes:
        attribute: Its name in MuJoCo's MjSpec.
        unit: SI unit, "" where it has none; {q} stands for rad or m, by the joint's type.
        how: LINEAR, ROTATION or DIRECTION.
        rare: Whether it is part of theta only where the two robots differ in it.
        off: Whether 0 means that there is none, which is far from any small value: a difference
            from 0 is then a discrete one.
    """

    attribute: str
    unit: str = ""
    how: str = LINEAR
    rare: bool = False
    off: bool = False


def _contact(friction: str = "friction") -> tuple[Parameter, ...]:
    """Parameters of a contact, shared by geoms and explicit contact pairs."""
    return (
        Parameter(friction),
        Parameter("margin", "m"),
        Parameter("gap", "m"),
        Parameter("solref"),
        Parameter("solimp"),
    )


_LIMIT = (Parameter("solref_limit"), Parameter("solimp_limit"))
_FRICTION = (Parameter("solref_friction"), Parameter("solimp_friction"))

# Facts of MuJoCo 3.17's MjSpec; https://mujoco.readthedocs.io/en/stable/XMLreference.html
CONTINUOUS: dict[str, tuple[Parameter, ...]] = {
    "body": (
        Parameter("pos", "m"),
        Parameter("quat", "rad", ROTATION),
        Parameter("gravcomp"),
        Parameter("mass", "kg"),
        Parameter("ipos", "m"),
        Parameter("iquat", "rad", ROTATION),
        Parameter("inertia", "kg m^2"),
    ),
    "joint": (
        Parameter("pos", "m"),
        Parameter("axis", "rad", DIRECTION),
        Parameter("range", "{q}"),
        Parameter("ref", "{q}"),
        Parameter("springref", "{q}"),
        Parameter("stiffness"),
        Parameter("damping"),
        Parameter("springdamper"),
        Parameter("frictionloss"),
        Parameter("armature"),
        Parameter("margin", "{q}"),
        Parameter("actfrcrange"),
        *_LIMIT,
        *_FRICTION,
    ),
    "geom": (
        Parameter("fromto", "m"),
        Parameter("pos", "m"),
        Parameter("quat", "rad", ROTATION),
        Parameter("size", "m"),
        Parameter("mass", "kg"),
        Parameter("density", "kg/m^3"),
        *_contact(),
        Parameter("solmix"),
        Parameter("fluid_coefs"),
        Parameter("surfacevel", "m/s", rare=True),
        Parameter("adhesion", "N", rare=True),
        Parameter("rgba"),
    ),
    "site": (
        Parameter("fromto", "m"),
        Parameter("pos", "m"),
        Parameter("quat", "rad", ROTATION),
        Parameter("size", "m"),
        Parameter("rgba"),
    ),
    "mesh": (Parameter("scale"), Parameter("uservert", "m")),
    "hfield": (Parameter("size", "m", rare=True), Parameter("userdata", rare=True)),
    "actuator": (
        Parameter("gear"),
        Parameter("gainprm"),
        Parameter("biasprm"),
        Parameter("dynprm"),
        Parameter("ctrlrange"),
        Parameter("forcerange"),
        Parameter("actrange"),
        Parameter("lengthrange"),
        Parameter("inheritrange"),
        Parameter("cranklength", "m"),
        Parameter("damping"),
        Parameter("armature"),
        Parameter("velrange", rare=True),
        Parameter("ffrange", rare=True),
        Parameter("delay", "s", rare=True),
    ),
    "tendon": (
        Parameter("range", "m"),
        Parameter("springlength", "m"),
        Parameter("stiffness"),
        Parameter("damping"),
        Parameter("frictionloss"),
        Parameter("armature"),
        Parameter("margin", "m"),
        Parameter("width", "m"),
        Parameter("actfrcrange"),
        Parameter("rgba", rare=True),
        *_LIMIT,
        *_FRICTION,
    ),
    "wrap": (Parameter("coef"), Parameter("divisor")),
    "equality": (Parameter("data"), Parameter("solref"), Parameter("solimp")),
    "pair": (*_contact(), Parameter("solreffriction"), Parameter("adhesion", "N", rare=True)),
    "sensor": (
        Parameter("cutoff", rare=True, off=True),
        Parameter("noise", rare=True),
        Parameter("delay", "s", rare=True),
        Parameter("interval", "s", rare=True),
    ),
    "camera": (
        Parameter("pos", "m"),
        Parameter("quat", "rad", ROTATION),
        Parameter("fovy", "deg"),
    ),
    "light": (Parameter("pos", "m"), Parameter("dir", "rad", DIRECTION)),
    "key": (
        Parameter("qpos"),
        Parameter("qvel"),
        Parameter("act"),
        Parameter("ctrl"),
        Parameter("mpos", "m"),
        Parameter("mquat", rare=True),  # MuJoCo makes it of length one
        Parameter("time", "s", rare=True),
    ),
    "option": (
        Parameter("timestep", "s"),
        Parameter("gravity", "m/s^2"),
        Parameter("wind", "m/s"),
        Parameter("magnetic"),
        Parameter("density", "kg/m^3"),
        Parameter("viscosity", "Pa s"),
        Parameter("impratio"),
        Parameter("sleep_tolerance", "m/s", rare=True),
        Parameter("o_margin", "m", rare=True),
        Parameter("o_solref", rare=True),
        Parameter("o_solimp", rare=True),
        Parameter("o_friction", rare=True),
    ),
}

# What has no in-between. A difference is refused, or switched at an alpha that the user names.
# Material is not here: it only chooses how a robot is drawn, and stays the source's. So does group,
# but for those of geoms that an inertia is inferred from, and of actuators that are switched off by
# it, which see `alignment` and `discrete`.
DISCRETE: dict[str, tuple[str, ...]] = {
    "body": ("mocap", "sleep"),
    "joint": ("type", "limited", "actfrclimited", "actgravcomp", "align"),
    "geom": (
        "type",
        "contype",
        "conaffinity",
        "condim",
        "priority",
        "fluid_ellipsoid",
        "typeinertia",
    ),
    "site": ("type",),
    "mesh": ("inertia", "maxhullvert"),
    "actuator": (
        "trntype",
        "dyntype",
        "gaintype",
        "biastype",
        "ctrllimited",
        "forcelimited",
        "actlimited",
        "actearly",
        "actdim",
        "ctrlspec",
        "nsample",
        "interp",
    ),
    "tendon": ("limited", "actfrclimited"),
    "wrap": ("type",),
    "equality": ("type", "active"),
    "pair": ("condim",),
    "sensor": ("intprm", "dim", "datatype", "needstage", "nsample", "interp"),
    "camera": (
        "resolution",
        "sensor_size",
        "focal_length",
        "focal_pixel",
        "principal_length",
        "principal_pixel",
        "proj",
    ),
    "option": (
        "integrator",
        "cone",
        "solver",
        "jacobian",
        "iterations",
        "tolerance",
        "ls_iterations",
        "ls_tolerance",
        "noslip_iterations",
        "noslip_tolerance",
        "ccd_iterations",
        "ccd_tolerance",
        "sdf_iterations",
        "sdf_initpoints",
        "disableflags",
        "enableflags",
        "disableactuator",
    ),
}


def discrete(kind: str, *, by_group: bool) -> tuple[str, ...]:
    """The attributes of a kind of element that have no in-between.

    Args:
        kind: Of element.
        by_group: Whether a robot disables actuators by their groups.

    Example:
        >>> discrete("site", by_group=False)
        ('type',)
    """
    return DISCRETE.get(kind, ()) + (("group",) if by_group and kind == "actuator" else ())
