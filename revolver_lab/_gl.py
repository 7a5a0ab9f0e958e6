"""Which OpenGL works on this machine: asked once, in a subprocess, before anything imports one."""

import atexit
import contextlib
import ctypes
import importlib.util
import json
import os
import platform
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from revolver_lab._versions import installed

CANDIDATES = ("egl", "osmesa")
"""Backends tried on Linux, best first (Mesa 25.1 dropped OSMesa, so EGL leads)."""

OFF = ("disabled", "disable", "off", "false", "0")
"""Values of MUJOCO_GL that mean "draw nothing", for mujoco and for dm_control."""

_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")

# Draws one real MuJoCo context, because a library that loads may still have no usable driver.
_PROBE = """
import importlib, os, mujoco
backend = os.environ["MUJOCO_GL"]
maker = importlib.import_module("mujoco." + backend).GLContext
context = maker(16, 16)
context.make_current()
drawing = mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), 100)
from OpenGL import GL
print("RENDERER", GL.glGetString(GL.GL_RENDERER).decode())
drawing.free()
context.free()
"""


@dataclass(frozen=True, kw_only=True)
class Renderer:
    """The OpenGL this process draws with.

    Attributes:
        backend: Value for MUJOCO_GL ("egl", "osmesa", "glfw", "disabled"), or "native" where the
            system's own OpenGL needs no choice (macOS, Windows).
        device: What OpenGL calls itself, such as "llvmpipe (LLVM 15.0.6, 256 bits)".
        chosen_by: "probe", or "user" where MUJOCO_GL was already set.
        trouble: One line for every backend that was tried and did not work.
    """

    backend: str
    device: str = ""
    chosen_by: str = "probe"
    trouble: tuple[str, ...] = ()

    @property
    def works(self) -> bool:
        """Whether frames can be drawn."""
        return self.backend == "native" or bool(self.device)

    @property
    def title(self) -> str:
        """Name for people: "GPU EGL", "Mesa EGL", "OSMesa", "none", ...

        Example:
            >>> Renderer(backend="egl", device="llvmpipe (LLVM 15.0.6, 256 bits)").title
            'Mesa EGL'
        """
        if not self.works:
            return "none"
        if self.backend != "egl":
            return {"osmesa": "OSMesa", "glfw": "GLFW"}.get(self.backend, self.backend)
        software = any(word in self.device.lower() for word in _SOFTWARE)
        return "Mesa EGL" if software else "GPU EGL"


_chosen: Renderer | None = None
_given = ""


def choose() -> Renderer:
    """Set MUJOCO_GL so that mujoco and dm_control draw without a screen, before their import.

    A MUJOCO_GL that the user set and that works is kept. Where nothing works MUJOCO_GL becomes
    "disabled": everything but rendering then still works, and `trouble` says what is wrong.

    Returns:
        The choice; the same object on every later call.
    """
    global _chosen, _given
    if _chosen is None:
        _given = os.environ.get("MUJOCO_GL", "").strip().lower()
        _chosen = probe()
        if _chosen.backend != "native":
            os.environ["MUJOCO_GL"] = _chosen.backend if _chosen.works else OFF[0]
        if _chosen.works and _chosen.backend in CANDIDATES:
            _load_triton()
    return _chosen


def _load_triton() -> None:
    """Load the library of torch's compiler, where there is one, ahead of Mesa's.

    Both bring an LLVM. Mesa's is seen by all that comes later, so a triton that is imported after
    a picture was drawn is bound to it, and the process dies: at the first step of an optimiser
    (torch 2.13 with CUDA, triton 3.7, Mesa with LLVM 15; torch for the CPU has no triton).
    """
    found = importlib.util.find_spec("triton")
    for folder in (found.submodule_search_locations or ()) if found else ():
        for library in Path(folder).glob("_C/libtriton*.so"):
            with contextlib.suppress(OSError):  # then it cannot be imported either
                ctypes.CDLL(str(library))


def probe(*, fresh: bool = False) -> Renderer:
    """Find a backend that draws, or check the one the user asked for, in a subprocess.

    Args:
        fresh: Ask again even if the cache file has an answer for these versions and this machine.

    Returns:
        The renderer; `works` is False where none does, and `trouble` says why. Only an answer
        that works is remembered, so that installing a driver is noticed at once.
    """
    # After `choose`, MUJOCO_GL holds our answer, not the user's question.
    given = os.environ.get("MUJOCO_GL", "").strip().lower() if _chosen is None else _given
    if given in OFF:
        return Renderer(backend=OFF[0], chosen_by="user", trouble=(f"MUJOCO_GL={given}",))
    if not sys.platform.startswith("linux"):
        return Renderer(backend="native", device="the system's own")
    known = None if fresh else _recall(given)
    if known is None:
        known = _try_each((given,) if given else CANDIDATES, "user" if given else "probe")
        if known.works:
            _remember(known, given)
    return known


def settle_exit() -> None:
    """Let the system end EGL at exit, instead of mujoco and dm_control.

    Both end the same display in an order that depends on which was imported first, and contexts
    freed afterwards print tracebacks. Call after either has been imported; calling twice is fine.
    """
    egl = sys.modules.get("OpenGL.EGL")
    if egl is not None:
        atexit.unregister(egl.eglTerminate)


def cache_file() -> Path:
    """Where the answer is kept: `gl.json` in the user's cache folder."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(home) / "revolver_lab" / "gl.json"


def _try_each(backends: tuple[str, ...], chosen_by: str) -> Renderer:
    """Return the first backend that draws, with the troubles of those before it."""
    trouble: list[str] = []
    for backend in backends:
        device, problem = _ask(backend)
        if device:
            return Renderer(
                backend=backend, device=device, chosen_by=chosen_by, trouble=tuple(trouble)
            )
        trouble.append(f"{backend}: {problem}")
    last = backends[0] if chosen_by == "user" else "disabled"
    return Renderer(backend=last, chosen_by=chosen_by, trouble=tuple(trouble))


def _ask(backend: str) -> tuple[str, str]:
    """Draw with `backend` in a subprocess: (device, "") if it works, else ("", the reason)."""
    if backend not in ("egl", "osmesa", "glfw"):
        return "", f"MUJOCO_GL={backend} is not one of egl, osmesa, glfw, disabled"
    environment = os.environ | {"MUJOCO_GL": backend}
    if backend in CANDIDATES and not os.environ.get("PYOPENGL_PLATFORM"):
        environment["PYOPENGL_PLATFORM"] = backend
    command = [sys.executable, "-c", _PROBE]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired) as problem:
        return "", str(problem).splitlines()[0]
    for line in done.stdout.splitlines():
        if line.startswith("RENDERER "):
            return line.removeprefix("RENDERER "), ""
    said = [line for line in done.stderr.splitlines() if line.strip()]
    return "", said[-1].strip() if said else f"ended with code {done.returncode}"


def _key(given: str) -> list[str]:
    """Everything that may change the answer: versions, machine, drivers, environment."""
    versions = [f"{name} {installed(name)}" for name in ("mujoco", "dm-control", "PyOpenGL")]
    devices = [str(path) for path in sorted(Path("/dev").glob("dri/*"))]
    names = ("MUJOCO_EGL_DEVICE_ID", "PYOPENGL_PLATFORM", "LD_LIBRARY_PATH")
    settings = [f"{name}={os.environ.get(name, '')}" for name in names]
    settings += [given, str(Path("/dev/nvidiactl").exists())]
    return [*versions, platform.python_version(), platform.node(), *devices, *settings]


def _recall(given: str) -> Renderer | None:
    """Answer from the cache file; None if it is absent, of another machine, or damaged."""
    try:
        stored = json.loads(cache_file().read_text(encoding="utf-8"))
        if stored["key"] != _key(given):
            return None
        fields = stored["renderer"]
        found = Renderer(**(fields | {"trouble": tuple(fields["trouble"])}))
        typed = isinstance(found.device, str) and isinstance(found.backend, str)
        return found if typed and found.works else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _remember(renderer: Renderer, given: str) -> None:
    """Write the cache file in one move; a folder that cannot be written is no error."""
    path = cache_file()
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as file:
            json.dump({"key": _key(given), "renderer": asdict(renderer)}, file)
        os.replace(file.name, path)
