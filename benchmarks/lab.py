"""The lab: slider to picture in a kernel and in a browser, bursts, memory, and pages."""

import json
import re
import tempfile
import time
from pathlib import Path

import numpy as np
from jupyter_client.manager import start_new_kernel

import revolver_lab as rvl
from benchmarks.timing import row
from tests import jupyter_browser as jupyter

NAME = "cheetah-front-leg"
MOVES, EVENTS, KEYS = 1000, 200, 60
NOTEBOOK = jupyter.ROOT / "notebooks" / "00_meet_the_robots.ipynb"

# Runs in a kernel, with real comms: an event is what the browser's message sets. A bare render is
# what mujoco itself takes for the same scene: update, render and read back, in the same context.
_IN_KERNEL = """
import asyncio, gc, json, statistics, time
import mujoco, numpy as np, psutil
import revolver_lab as rvl
from revolver_lab.lab import explorer
from revolver_lab.lab.standins import shared_stage
evolve = rvl.load({name!r})
app = rvl.lab.explore(evolve)
stage, draws, depth = shared_stage(evolve), [], []
keep = app.draw

sent = []
keep_sync = app.image.send_state

def stamped(key=None):
    keep_sync(key)
    sent.append(time.perf_counter())

app.image.send_state = stamped

def counted(full):
    keep(full)
    draws.append((app.slider.value, full))

app.pacer._draw = counted

def bare():
    width, height = explorer.QUICK
    rect, every = mujoco.MjrRect(0, 0, width, height), mujoco.mjtCatBit.mjCAT_ALL.value
    pixels = np.empty((height, width, 3), np.uint8)
    with stage._context:
        mujoco.mjv_updateScene(
            stage.model, stage.data, stage._option, None, camera, every, stage._scene
        )
        mujoco.mjr_render(rect, stage._scene, stage._drawing)
        mujoco.mjr_readPixels(pixels, None, rect, stage._drawing)

async def event(alpha):
    start, before = time.perf_counter(), len(draws)
    app.slider.value = alpha
    while len(draws) == before:
        await asyncio.sleep(0)
    return sent[-1] - start, time.perf_counter() - start

async def measure():
    global camera
    camera = stage._find_camera("fit")
    alphas = np.linspace(0, 1, 101).tolist()
    await event(0.5)
    pairs = []
    for alpha in alphas[1::2]:
        spent = await event(alpha)
        await asyncio.sleep(0.02)  # the slider is dragged on, and the kernel has read its messages
        start = time.perf_counter()
        bare()
        pairs.append((*spent, time.perf_counter() - start))
    await app.pacer.rest()
    draws.clear()
    for number in range({events}):
        app.slider.value = number / {events}
        await asyncio.sleep(0)
    meanwhile = len(draws)
    await app.pacer.rest()
    burst = list(draws)
    memory = psutil.Process().memory_info
    for alpha in alphas:  # every robot of the slider is compiled, and cached, once
        await event(alpha)
    gc.collect()
    start = memory().rss
    for number in range({moves}):
        await event((number * 0.618034) % 1)
    gc.collect()
    return dict(pairs=pairs, burst=burst, meanwhile=meanwhile, grown=memory().rss - start)

RESULT = await measure()
print("RESULT" + json.dumps(RESULT))
"""
# Runs in the page: time from a key press to the load of the next picture.
_WATCH = """() => { const image = document.querySelector("img.widget-image"); window.took = [];
  document.addEventListener("keydown", event => { window.pressed ??= event.timeStamp; }, true);
  image.addEventListener("load", () => requestAnimationFrame(() => {
    if (window.pressed) { window.took.push(performance.now() - window.pressed);
      window.pressed = undefined; } })); }"""


def run() -> list[dict]:
    """Rows of the table of benchmarks."""
    return [*in_kernel(), in_browser(), page(), notebook()]


def execute(code: str, seconds: float, *cells: str) -> list[str]:
    """Run cells in a fresh kernel; what the last one printed."""
    manager, client = start_new_kernel(cwd=str(jupyter.ROOT))
    said: list[str] = []
    try:
        for cell in (code, *cells):
            said = _run(client, cell, seconds)
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
    return said


def _run(client, cell: str, seconds: float) -> list[str]:
    said = []

    def hear(message: dict) -> None:
        if message["msg_type"] == "stream":
            said.append(message["content"]["text"])

    reply = client.execute_interactive(cell, timeout=seconds, output_hook=hear)
    if reply["content"]["status"] != "ok":
        raise RuntimeError("\n".join(reply["content"]["traceback"]))
    return said


def in_kernel() -> list[dict]:
    """Events, bursts and memory."""
    said = execute(_IN_KERNEL.format(name=NAME, moves=MOVES, events=EVENTS), 600)
    found = json.loads(re.search(r"RESULT(.*)", "".join(said))[1])
    ours, whole, bare = np.array(found["pairs"]).T
    values = [value for value, _ in found["burst"]]
    queued = len(values) - found["meanwhile"]
    last = values[-1] == (EVENTS - 1) / EVENTS
    return [
        row("slider event to new frame, 320x240, in the kernel", "bare render of that scene",
            "<= 1.3, >= 20 frames/s", float(np.median(ours / bare)),
            f"{1000 * np.median(ours):.1f} ms against {1000 * np.median(bare):.1f} ms, "
            f"{1 / np.median(whole):.0f} frames/s, table included"),
        row(f"{EVENTS} slider events in one burst", "renders queued when it ends", "<= 2", queued,
            f"{found['meanwhile']} during the burst; the last value is shown: {last}"),
        row(f"{MOVES} slider moves", "growth of memory [MB]", "< 20", found["grown"] / 1e6, ""),
    ]  # fmt: skip


def in_browser() -> dict:
    """Key press to new picture, in headless Chromium."""
    with tempfile.TemporaryDirectory() as folder:
        cells = ("import revolver_lab as rvl", f"rvl.lab.explore(rvl.load({NAME!r}))")
        jupyter.write_notebook(Path(folder) / "lab.ipynb", *cells)
        with jupyter.server(Path(folder)) as address, jupyter.browser() as (page, _):
            jupyter.open_notebook(page, address, "lab.ipynb")
            jupyter.run_all(page)
            page.wait_for_selector("img.widget-image", timeout=60_000)
            jupyter.wait_idle(page, 60)
            page.locator(".noUi-handle").first.focus()
            page.evaluate(_WATCH)
            for number in range(KEYS):
                page.keyboard.press("ArrowRight")
                page.wait_for_function(f"window.took.length > {number}", timeout=20_000)
                page.wait_for_timeout(500)  # the full picture has come and gone
            took = np.array(page.evaluate("window.took"))
    low, high = np.percentile(took, (50, 95))
    return row("slider key press to new picture, headless Chromium", "95th percentile [ms]",
               "<= 150", float(high), f"median {low:.0f} ms, {len(took)} presses")  # fmt: skip


def page() -> dict:
    """A static slider's size, opened from a file with the network off."""
    start = time.perf_counter()
    sizes = {}
    for name in (NAME, "humanoid-length-mass"):
        made = rvl.lab.static_slider(rvl.load(name))
        sizes[name] = len(made.fragment) / 1e6
    spent = time.perf_counter() - start
    with tempfile.TemporaryDirectory() as folder, jupyter.browser(offline=True) as (view, errors):
        view.goto(f"file://{made.save(Path(folder) / 'slider.html')}")
        view.locator("input[type=range]").focus()
        view.keyboard.press("End")
        shown = view.locator("output").inner_text()
    works = shown.startswith("alpha 1,") and not errors
    told = ", ".join(f"{name} {size:.2f} MB" for name, size in sizes.items())
    return row(
        "static_slider, 41 frames, 480x360", "MB, from a file, network off", "< 3",
        max(sizes.values()), f"{told}; works: {works}; {spent:.0f} s to make both",
    )  # fmt: skip


def notebook() -> dict:
    """Memory of the kernel at the end of notebook 00."""
    cells = [
        "".join(cell["source"])
        for cell in json.loads(NOTEBOOK.read_text())["cells"]
        if cell["cell_type"] == "code"
    ]
    ask = "import psutil, sys; print(psutil.Process().memory_info().rss, 'torch' in sys.modules)"
    said = "".join(execute(cells[0], 600, *cells[1:], ask)).split()
    return row("kernel of notebook 00 at the end", "GB resident", "< 1.2, torch not imported",
               int(said[0]) / 1e9, f"torch imported: {said[1]}")  # fmt: skip


if __name__ == "__main__":
    for line in run():
        print(line)
