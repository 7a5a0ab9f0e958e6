"""Latest value wins: a burst of events becomes few draws, quick ones first and a full one after."""

import asyncio
from collections.abc import Callable

QUIET = 0.004
"""Seconds without another event after which what was asked last is drawn."""
PATIENCE = 0.3
"""Seconds after which it is drawn even if events keep coming."""
SETTLE = 0.25
"""Seconds of rest after which the full picture follows the quick one."""


class Pacer:
    """Decides when to draw, on the thread of the event loop, to which the GL context belongs.

    The first event after a rest is drawn at once; those that come meanwhile are merged. At most
    one draw runs and one waits, however many events there are, and the last event is always drawn.

    Args:
        draw: Draws what is wanted now; True asks for full quality. Errors are its own business.
        settle: Seconds of rest before the full picture.
    """

    def __init__(self, draw: Callable[[bool], None], *, settle: float = SETTLE):
        self._draw, self._settle = draw, settle
        self._task: asyncio.Task[None] | None = None
        self._news: asyncio.Event | None = None
        self._asked = 0

    def ask(self) -> None:
        """Tell that something changed; where no event loop runs, it is drawn here and now."""
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            self._draw(True)
            return
        self._asked += 1
        if self._task is None or self._task.done() or self._task.get_loop() is not loop:
            self._news = asyncio.Event()
            self._task = loop.create_task(self._run(self._news))
        elif self._news is not None:
            self._news.set()

    async def rest(self) -> None:
        """Wait until everything asked for is drawn in full."""
        if self._task is not None:
            await self._task

    def stop(self) -> None:
        """Draw nothing any more of what was asked for."""
        if self._task is not None and not self._task.done():
            self._task.cancel()

    async def _run(self, news: asyncio.Event) -> None:
        """Draw quickly as long as there is news, then once in full."""
        while True:
            news.clear()
            self._draw(False)
            # Messages that arrived during the draw are read before the next.
            if await _within(news, QUIET):
                await self._calm(news)
            elif not await _within(news, self._settle):
                break
        self._draw(True)
        if news.is_set():  # only a draw that asks itself gets here
            await self._run(news)

    async def _calm(self, news: asyncio.Event) -> None:
        """Wait for the end of a burst, but not for ever."""
        loop = asyncio.get_running_loop()
        enough = loop.time() + PATIENCE
        while loop.time() < enough:
            news.clear()
            if not await _within(news, QUIET):
                return


async def _within(news: asyncio.Event, seconds: float) -> bool:
    """Whether there is news within some seconds."""
    try:
        await asyncio.wait_for(news.wait(), seconds)
    except TimeoutError:
        return False
    return True
