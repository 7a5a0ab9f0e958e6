"""Robot files of the installed packages, found without importing those packages."""

import importlib.util
from pathlib import Path

import mujoco

from revolver_lab.errors import MissingExtraError, RobotFileError

SKY = 100
"""Edge of a suite robot's skybox [pixels]."""


def installed_file(package: str, path: str) -> Path:
    """Return the path of a file that an installed package ships.

    The package is located, not imported: importing dm_control would already choose a renderer.

    Args:
        package: A top-level package, e.g. "dm_control".
        path: The file's path inside it.

    Raises:
        MissingExtraError: If the package is not installed.
        RobotFileError: If it is, but ships no such file.
    """
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        raise MissingExtraError(
            f"no package {package!r}", "an installed one", f"Run: pip install {package}"
        )
    found = Path(spec.origin).parent / path
    if not found.is_file():
        raise RobotFileError(
            f"{package} without {path}",
            "the versions that pyproject.toml pins",
            f"Reinstall {package} at the pinned version.",
        )
    return found


def installed_spec(package: str, path: str) -> mujoco.MjSpec:
    """Read an installed robot file into a spec of the caller's own.

    Example:
        >>> installed_spec("gymnasium", "envs/mujoco/assets/ant.xml").modelname
        'ant'
    """
    return mujoco.MjSpec.from_file(str(installed_file(package, path)))


def feel_contacts(spec: mujoco.MjSpec, body: str) -> None:
    """Add an accelerometer to ``body``, so that MuJoCo computes the contact forces on every body.

    ``cfrc_ext`` is filled only where a sensor asks for accelerations; Gym calls
    ``mj_rnePostConstraint`` by hand instead, which a batch of simulations cannot do.

    Args:
        spec: The robot, changed in place.
        body: The body that carries the sensor.
    """
    spec.add_sensor(
        name=f"{body}_acceleration",
        type=mujoco.mjtSensor.mjSENS_FRAMELINACC,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        objname=body,
    )


def shrink_sky(spec: mujoco.MjSpec) -> None:
    """Make the suite's skybox small; its 800 pixels take 0.2 s and 11 MB in every compile.

    Args:
        spec: A robot of dm_control's suite, changed in place.
    """
    sky = spec.texture("skybox")
    sky.width = sky.height = SKY
    sky.mark = mujoco.mjtMark.mjMARK_NONE  # stars of so few pixels would be snowballs
