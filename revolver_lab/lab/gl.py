"""One OpenGL context at a time, borrowed inside a `with` block and given back unchanged."""

import atexit
import contextlib
import os
import threading
import weakref
from collections.abc import Callable, Iterator
from typing import Any

from revolver_lab import _gl
from revolver_lab._gl import Renderer
from revolver_lab.errors import MissingExtraError

PACKAGES = "sudo apt-get install -y libegl1 libegl-mesa0 libgl1-mesa-dri"
"""The one line that brings Mesa's EGL to Debian and Ubuntu."""

_OTHERWISE = "Let a working one be chosen: unset MUJOCO_GL"


def ensure() -> Renderer:
    """A renderer that works, with MUJOCO_GL and PYOPENGL_PLATFORM set for it.

    Returns:
        What draws here; asked once per machine.

    Raises:
        MissingExtraError: If nothing draws, with the one line that mends it.
    """
    renderer = _gl.choose()
    if not renderer.works:
        tried = "; ".join(renderer.trouble)
        raise MissingExtraError(
            f"no OpenGL that works ({tried})", "EGL (a GPU's or Mesa's) or OSMesa", remedy(renderer)
        )
    if renderer.backend in _gl.CANDIDATES:
        os.environ.setdefault("PYOPENGL_PLATFORM", renderer.backend)
    return renderer


def remedy(renderer: Renderer) -> str:
    """The one line that makes rendering work; empty where it does.

    Example:
        >>> remedy(Renderer(backend="disabled", trouble=("egl: no library",)))
        "Install Mesa's: sudo apt-get install -y libegl1 libegl-mesa0 libgl1-mesa-dri"
    """
    if renderer.works:
        return ""
    if any("PYOPENGL_PLATFORM" in line for line in renderer.trouble):
        return "Let it be chosen: unset PYOPENGL_PLATFORM"
    if renderer.chosen_by == "probe":
        return f"Install Mesa's: {PACKAGES}"
    return f"Use EGL: {PACKAGES}; unset MUJOCO_GL" if renderer.backend == "osmesa" else _OTHERWISE


class Context:
    """An OpenGL context that is current only inside its `with` block.

    Whatever was current before (dm_control remembers its own and never asks again) is current
    again afterwards, so pictures can be interleaved with `physics.render`. It may be entered from
    any thread, one at a time.

    Args:
        width: Widest picture it will draw at first [pixels].
        height: Highest picture it will draw at first [pixels].

    Raises:
        MissingExtraError: If no OpenGL works here.
    """

    def __init__(self, width: int, height: int):
        backend = ensure().backend
        maker, self._keeping = _maker(backend)
        self._lock = threading.RLock()
        with self._keeping():
            self._native: Any = maker(width, height)
        self._freed: list[Callable[[], None]] = []
        _open.add(self)
        # Moved to the end at each new context: exit handlers run last in, first out.
        atexit.unregister(_free_all)
        atexit.register(_free_all)

    def __enter__(self) -> "Context":
        self._lock.acquire()
        _gl.settle_exit()  # each time: dm_control may have been imported since
        self._before = self._keeping()
        self._before.__enter__()
        self._native.make_current()
        return self

    def __exit__(self, *exception: object) -> None:
        self._before.__exit__(None, None, None)
        self._lock.release()

    def on_free(self, action: Callable[[], None]) -> None:
        """Call `action` with this context current, just before it is freed."""
        self._freed.append(action)

    def free(self) -> None:
        """Free the context and what was drawn with it; calling twice is fine."""
        if self._native is None:
            return
        native, self._native = self._native, None
        _open.discard(self)
        with contextlib.suppress(_gl_error()), self._keeping():
            native.make_current()
            for action in self._freed:
                action()
            native.free()
        # If something else ended EGL first the context went with it; never try again.
        native._context = None

    def __del__(self) -> None:
        if getattr(self, "_native", None) is not None:
            self.free()


_open: "weakref.WeakSet[Context]" = weakref.WeakSet()


def _free_all() -> None:
    """Free every context while Python is still whole."""
    for context in list(_open):
        context.free()


def _gl_error() -> type[Exception]:
    """Class of the errors that a dead display raises (RuntimeError where PyOpenGL is absent)."""
    try:
        from OpenGL.error import Error
    except ImportError:
        return RuntimeError
    return Error


def _maker(backend: str) -> tuple[Callable[[int, int], Any], Callable[[], Any]]:
    """The class that makes contexts, and the guard that restores what was current."""
    if backend == "egl":
        from mujoco.egl import GLContext

        return GLContext, _keep_egl
    if backend == "osmesa":
        from mujoco.osmesa import GLContext

        return GLContext, contextlib.nullcontext
    from mujoco.rendering.classic.gl_context import GLContext

    return GLContext, contextlib.nullcontext


@contextlib.contextmanager
def _keep_egl() -> Iterator[None]:
    """Make current again whatever EGL context this thread had."""
    from mujoco import egl

    api = egl.EGL
    before = api.eglGetCurrentContext()
    drawn, read = (api.eglGetCurrentSurface(which) for which in (api.EGL_DRAW, api.EGL_READ))
    shown = api.eglGetCurrentDisplay() if before else egl.EGL_DISPLAY
    try:
        yield
    finally:
        if shown or egl.EGL_DISPLAY:
            current = before or api.EGL_NO_CONTEXT
            api.eglMakeCurrent(shown or egl.EGL_DISPLAY, drawn, read, current)
