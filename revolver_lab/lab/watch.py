"""Training as it happens: live in a notebook, a picture of its end where nobody looks on."""

import contextlib
from pathlib import Path
from typing import Any

from revolver_lab.errors import SettingsError
from revolver_lab.lab.trees import Drawing
from revolver_lab.lab.watch_front_end import somebody_looks
from revolver_lab.lab.watch_view import View
from revolver_lab.lab.watching import CHECKPOINTS, Watching
from revolver_lab.runs import Plan, Run

_watched: dict[Path, Watching] = {}


def watch(
    run: Run | Plan | str | Path, *, wait: bool | None = None, film: bool = True
) -> Watching | Drawing:
    """Trains a run and shows how it is doing.

    In a notebook that somebody looks at: progress, alpha of every learner, returns on the target
    with intervals, returns in training, and a film of the current policy, kept up to date; it can
    be stopped and resumed. Training goes on when the widgets are closed; `run.stop()` stops it,
    and `run.wait()` in a later cell keeps the widgets up to date while it waits. A run watched
    twice moves to the later cell.

    Elsewhere (nbmake, nbconvert, papermill, plain Python) it trains to the end and draws the same
    figure once. Somebody is taken to look on where the cell could ask for input, which all of
    those refuse; the environment variable REVOLVER_LAB_LIVE=1 or 0 overrules this.

    Args:
        run: A run, or what it is to train; a folder holds a run. A new or a stopped one is
            started; of a failed one it is said why, and Resume tries again.
        wait: Whether to wait for the end, and then draw. None waits where nobody looks on. False
            draws there how things are now.
        film: Whether to film the policy.

    Returns:
        Widgets, or a drawing; a notebook shows either as the last line of a cell.

    Raises:
        SettingsError: If there is no such run, or it is of another version.

    Example:
        >>> plan = Plan(robot="cheetah-front-leg", methods=["scratch"], seeds=[0])
        >>> watch("no/such/folder")
        Traceback (most recent call last):
        ...
        revolver_lab.errors.SettingsError: no/such/folder/config.json, which cannot be read ...
    """
    chosen = as_run(run)
    earlier = _watched.pop(chosen.folder.resolve(), None)
    if earlier is not None:
        earlier.close()
    if chosen.status().state in ("new", "stopped"):
        chosen.start(every=CHECKPOINTS)
    seen = somebody_looks()
    if seen and not wait:
        shown = Watching(chosen, film=film)
        _watched[chosen.folder.resolve()] = shown
        shown.begin()
        return shown
    if wait or (wait is None and not seen):
        with contextlib.suppress(SettingsError):  # one that fails or is stopped is drawn as it is
            chosen.wait()
    view = View(chosen)
    return view.drawing(view.look())


def as_run(given: Any) -> Run:
    """Returns the run that is meant by a run, a plan or a folder.

    Raises:
        SettingsError: If it is none of these, or the folder holds no run.
    """
    if isinstance(given, Plan):
        return Run(given)
    if isinstance(given, str | Path):
        return Run.open(given)
    if not all(hasattr(given, name) for name in ("status", "start", "stop", "folder")):
        raise SettingsError(f"a {type(given).__name__}", "a Run, a Plan, or the folder of a run",
                            "Try rvl.lab.watch(Run(plan)).")  # fmt: skip
    return given
