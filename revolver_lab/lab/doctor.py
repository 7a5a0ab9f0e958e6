"""What was found on this machine, and the one line that mends what is missing."""

import platform
from dataclasses import dataclass

from revolver_lab import _gl, _versions
from revolver_lab.errors import MissingExtraError
from revolver_lab.lab import encoders, gl

_LISTED = ("mujoco", "dm-control", "gymnasium", "numpy", "PyOpenGL")
_TRAIN = "pip install 'revolver-lab[train]'"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        what: What it is.
        found: What was found.
        mend: The one line that mends it; "" where nothing is wrong.
        needed_for: What does not work without it; "" where everything needs it.
    """

    what: str
    found: str
    mend: str = ""
    needed_for: str = ""

    def __str__(self) -> str:
        purpose = f" (only for {self.needed_for})" if self.mend and self.needed_for else ""
        line = f"{'ok ' if not self.mend else '-- '} {self.what:<11} {self.found}{purpose}"
        return line + (f"\n               {self.mend}" if self.mend else "")


def probe_report() -> list[Finding]:
    """Look at Python, the simulators, OpenGL, torch and ffmpeg; OpenGL is asked afresh.

    Returns:
        One finding for each; `str` of a finding is a line for people.
    """
    return [_python(), _simulators(), _opengl(), _torch(), _ffmpeg()]


def _python() -> Finding:
    return Finding(what="python", found=f"{platform.python_version()} on {platform.platform()}")


def _simulators() -> Finding:
    found = ", ".join(f"{name} {_versions.installed(name)}" for name in _LISTED)
    try:
        _versions.check()
    except MissingExtraError as problem:
        return Finding(what="simulators", found=found, mend=problem.remedy)
    return Finding(what="simulators", found=found)


def _opengl() -> Finding:
    renderer = _gl.probe(fresh=True)
    found = f"{renderer.title}: {renderer.device}" if renderer.works else "nothing that draws"
    source = ", from MUJOCO_GL" if renderer.chosen_by == "user" else ""
    tried = f" [{'; '.join(renderer.trouble)}]" if renderer.trouble else ""
    return Finding(
        what="opengl", found=f"{found}{source}{tried}", mend=gl.remedy(renderer),
        needed_for="pictures and films",
    )  # fmt: skip


def _torch() -> Finding:
    found = [(name, _versions.installed(name)) for name in ("torch", "stable-baselines3")]
    missing = any(version == "missing" for _, version in found)
    said = ", ".join(f"{name} {version}" for name, version in found)
    return Finding(what="training", found=said, mend=_TRAIN * missing, needed_for="training")


def _ffmpeg() -> Finding:
    try:
        where = encoders.ffmpeg_module().get_ffmpeg_exe()
    except MissingExtraError as problem:
        return Finding(what="ffmpeg", found="missing", mend=problem.remedy, needed_for=".mp4 films")
    return Finding(what="ffmpeg", found=where)
