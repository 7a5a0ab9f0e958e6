"""The tested pair of simulators: another version is refused in one line, before it is imported."""

from importlib import metadata

from revolver_lab.errors import MissingExtraError

TESTED = {"mujoco": "3.17.", "dm-control": "1.0.50"}
"""Distribution -> what its version has to begin with."""

REMEDY = "Install the tested pair: pip install 'mujoco>=3.17,<3.18' 'dm-control==1.0.50'"


def installed(name: str) -> str:
    """Version of an installed distribution, or "missing".

    Example:
        >>> installed("no-such-thing")
        'missing'
    """
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing"


def check() -> None:
    """Refuse versions of MuJoCo and dm_control that this package was not tested with.

    Raises:
        MissingExtraError: If one is missing or of another version; it says what to install.
    """
    for name, wanted in TESTED.items():
        found = installed(name)
        if found != wanted and not (wanted.endswith(".") and found.startswith(wanted)):
            allowed = f"{name} {wanted}x" if wanted.endswith(".") else f"{name} {wanted}"
            raise MissingExtraError(f"{name} {found}", allowed, REMEDY)
