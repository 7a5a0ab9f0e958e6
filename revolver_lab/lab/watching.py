"""The widgets of a run: progress, figure, film, and buttons that stop and resume it."""

import asyncio
import contextlib
import html
import time
from collections.abc import Callable, Generator
from typing import Any

from revolver_lab.lab.explore import error_text
from revolver_lab.lab.pictures import Picture
from revolver_lab.lab.watch_film import HEIGHT, WIDTH, Filming, Scene
from revolver_lab.lab.watch_view import View, numbers
from revolver_lab.runs import Run, Status

POLL = 1.0
"""Seconds between looks at the folder."""
CHECKPOINTS = 30.0
"""Seconds between the checkpoints of a run that is started here; each brings a policy to film."""
_PATIENCE = 2.0  # seconds between figures, at least
_SHARE = 8  # a figure is drawn anew after so many times as long as drawing it took
_LATE = 30  # looks after the end at whether somebody is there to see the last film


class Watching:
    """What a notebook shows of a run.

    Args:
        run: What is shown.
        film: Whether its policy is filmed at first; there is a box to tick.

    Attributes:
        widget: The widget that holds all others, to put into one of your own.
        over: Whether there is nothing more to look at: the run is finished, or this is closed.
    """

    def __init__(self, run: Run, *, film: bool = True):
        self.run, self.over = run, False
        self._errors: dict[str, Exception] = {}
        self.view, self.filming = View(run), Filming(run)
        self._resume, self._closed = False, False
        self._told, self._looked = "", float("-inf")
        self._drawn, self._again = (), float("-inf")
        self._polling: asyncio.Task[None] | None = None
        self._take: asyncio.Task[None] | None = None
        self._build(film)
        self.stop.on_click(self.on_stop)
        self.resume.on_click(self.on_resume)

    def begin(self) -> None:
        """Looks now, and then every second on the thread of the event loop, until it is over."""
        self.run.watchers.append(self.on_wait)
        self.look()
        with contextlib.suppress(RuntimeError):  # without an event loop others call look()
            loop = asyncio.get_running_loop()
            self._polling = loop.create_task(self._poll())

    def on_stop(self, button: object) -> None:
        """Asks the run to stop; it is not waited for, as the kernel has to answer meanwhile."""
        self._resume = False
        if self._guarded("button", self._halt):
            self.look()

    def on_resume(self, button: object) -> None:
        """Trains on, at once or as soon as the run has stopped."""
        if self._guarded("button", self._go_on):
            self.look()

    def on_wait(self, status: Status) -> None:
        """Look on behalf of the event loop, which stands still while a cell waits for the run.

        Args:
            status: How the run is doing.
        """
        if self.over or (time.monotonic() - self._looked < POLL and status.state == "running"):
            return
        self.look()
        scene = self._scene(status) if status.state == "running" else None
        if scene is not None:
            if self._take is not None:
                self._take.cancel()
            self._guarded("film", lambda: self._show_film(self.filming.shoot(scene)))

    def look(self) -> None:
        """Brings everything up to date but the film; an error is shown, and not raised."""
        if not self.over:
            self._looked = time.monotonic()
            self._guarded("look", self._look)

    def close(self) -> None:
        """Stops looking and removes the widgets from the page; the run goes on."""
        self.over = self._closed = True
        with contextlib.suppress(ValueError):
            self.run.watchers.remove(self.on_wait)
        for task in (self._polling, self._take):
            if task is not None:
                task.cancel()
        for widget in (self.bar, self.words, self.numbers, self.stop, self.resume, self.box,
                       self.figure, self.film, self.trouble, self.widget):  # fmt: skip
            widget.close()

    async def _poll(self) -> None:
        """Looks every second, and films when there is news and somebody to see it."""
        late = _LATE
        while late and not self._closed:
            await asyncio.sleep(POLL)
            self.look()
            late -= self.over
            if self.widget._view_count and (self._take is None or self._take.done()):
                scene = self._scene()
                if scene is not None:
                    late = late if not self.over else 0
                    self._take = asyncio.get_running_loop().create_task(self._film(scene))

    def _look(self) -> None:
        """Looks at the folder, and shows what is there."""
        status = self.view.look()
        if self._resume and status.state not in ("running", "stopping"):
            self._go_on()
            status = self.view.look()
        self.bar.value = status.fraction
        told = self.view.headline(status, resuming=self._resume)
        if told != self._told:  # screen readers read it when it changes
            self._told, self.words.value = told, f'<div role="status">{html.escape(told)}</div>'
        self.numbers.value = numbers(status)
        self._draw(status)
        if status.state == "finished":
            self.over = self.stop.disabled = self.resume.disabled = True

    def _halt(self) -> None:
        """Tells the workers to stop, where there are any to tell."""
        if self.view.look().state == "running":
            self.run.stop(patience=0.0)

    def _go_on(self) -> None:
        """Starts the run; one that is about to stop is started once it has."""
        self._resume = self.view.look().state == "stopping"
        if not self._resume:
            self.run.start(every=CHECKPOINTS)

    def _draw(self, status: Status) -> None:
        """Draws the figure where there is something new in it, and not all the time."""
        news = (status.state, *(
            (one.alpha, one.episode_return, len(one.evaluations), one.over, one.failure)
            for one in status.learners
        ))  # fmt: skip
        started = time.monotonic()
        changed = not self._drawn or self._drawn[0] != status.state
        if news == self._drawn or (started < self._again and not changed):
            return
        self.figure.value = self.view.drawing(status)._repr_html_()
        self._drawn, ended = news, time.monotonic()
        self._again = ended + max(_PATIENCE, _SHARE * (ended - started))

    def _scene(self, status: Status | None = None) -> Scene | None:
        """What to film now; nothing where nobody wants to see it."""
        found: list[Scene | None] = [None]

        def ask() -> None:
            found[0] = self.filming.due(status or self.view.look())

        if self.box.value:
            self._guarded("scene", ask)
        return found[0]

    async def _film(self, scene: Scene) -> None:
        """Films a frame at a time, and answers to buttons in between."""
        frames, going = self.filming.shoot(scene), True

        def step() -> None:
            nonlocal going
            going = self._step(frames)

        while going and self._guarded("film", step):
            await asyncio.sleep(0.01)

    def _show_film(self, frames: Generator[None, None, Picture | None]) -> None:
        """Films all at once."""
        while self._step(frames):
            pass

    def _step(self, frames: Generator[None, None, Picture | None]) -> bool:
        """Draws one more frame; after the last, shows the film and says that it is done."""
        try:
            next(frames)
        except StopIteration as end:
            if end.value is not None and not self._closed:
                words = html.escape(end.value.alt)
                self.film.value = f"{end.value._repr_html_()}<div>{words}</div>"
            return False
        return True

    @property
    def error(self) -> Exception | None:
        """Returns an error that is shown now; None once what failed has worked again."""
        return next(iter(self._errors.values()), None)

    def _guarded(self, kind: str, work: Callable[[], Any]) -> bool:
        """Does some work and says whether it worked; what goes wrong is shown until it works."""
        before = self.error
        try:
            work()
        except Exception as problem:
            self._errors[kind] = problem
        else:
            self._errors.pop(kind, None)
        if self.error is not before and not self._closed:
            self.trouble.value = "".join(map(error_text, self._errors.values()))
        return kind not in self._errors

    def _build(self, film: bool) -> None:
        """Makes the widgets and lays them out."""
        import ipywidgets as w

        self.bar = w.FloatProgress(min=0.0, max=1.0, layout=w.Layout(width="100%"))
        self.words, self.numbers, self.trouble = w.HTML(), w.Label(), w.HTML()
        self.stop = w.Button(description="Stop", tooltip="Checkpoint, then stop")
        self.resume = w.Button(description="Resume", tooltip="Train on from there")
        self.box = w.Checkbox(value=film, description="film the policy", indent=False,
                              layout=w.Layout(width="auto"))  # fmt: skip
        self.figure = w.HTML(layout=w.Layout(flex="1 1 480px", max_width="920px"))
        self.film = w.HTML(layout=w.Layout(flex="0 1 auto", width=f"{WIDTH + 8}px",
                                           min_height=f"{HEIGHT}px"))  # fmt: skip
        wrap = w.Layout(flex_flow="row wrap", width="100%")
        self.widget = w.VBox([
            self.words, self.bar, self.numbers,
            w.HBox([self.stop, self.resume, self.box], layout=wrap), self.trouble,
            w.HBox([self.figure, self.film], layout=wrap),
        ], layout=w.Layout(width="100%"))  # fmt: skip
        self.widget._view_count = 0  # from now on the front end counts who looks

    def _repr_mimebundle_(self, **kwargs: Any) -> Any:
        """Show the widgets; Jupyter asks for it."""
        return self.widget._repr_mimebundle_(**kwargs)
