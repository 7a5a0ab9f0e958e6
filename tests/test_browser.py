"""A student's way: JupyterLab in a real browser, the notebook run, the slider moved by keyboard."""

import importlib.util
import io
import shutil

import numpy as np
import pytest
from jupyter_browser import CHROMIUM, ROOT, browser, open_notebook, run_all, server, wait_idle
from PIL import Image

from revolver_lab.lab import player

NOTEBOOK = ROOT / "notebooks" / "00_meet_the_robots.ipynb"
OUT = ROOT / "out"
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: make test-browser installs it"),
    pytest.mark.skipif(
        not importlib.util.find_spec("playwright") or not importlib.util.find_spec("jupyterlab"),
        reason="playwright or jupyterlab is missing",
    ),
]


def looks(page, selector: str) -> np.ndarray:
    """The pixels that an element has on the screen."""
    shot = page.locator(selector).first.screenshot()
    return np.array(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def wait_for_change(page, selector: str, before: str) -> None:
    page.wait_for_function(
        "([selector, before]) => document.querySelector(selector).src !== before",
        arg=[selector, before], timeout=20_000,
    )  # fmt: skip


def test_in_jupyterlab_the_slider_moves_by_keyboard_and_the_picture_follows(tmp_path):
    shutil.copy(NOTEBOOK, tmp_path / "lab.ipynb")
    picture, handle = "img.widget-image", ".noUi-handle"
    with server(tmp_path) as address, browser() as (page, errors):
        open_notebook(page, address, "lab.ipynb")
        run_all(page)
        page.wait_for_selector(picture, timeout=60_000)
        wait_idle(page, 150)  # a kernel that runs cells does not listen to sliders
        page.locator(handle).first.focus()
        source, robot = page.locator(picture).first.get_attribute("src"), looks(page, picture)
        for _ in range(12):
            page.keyboard.press("PageUp")
        wait_for_change(page, picture, source)
        page.wait_for_function(
            "() => document.querySelector('.widget-readout').textContent > 0.55", timeout=20_000
        )
        page.wait_for_timeout(1000)  # the picture in full follows the quick one
        assert (np.abs(looks(page, picture) - robot).max(axis=2) > 30).mean() > 0.005
        assert "alpha 0." in page.locator(picture).first.get_attribute("title")
        OUT.mkdir(exist_ok=True)
        page.locator(picture).first.scroll_into_view_if_needed()
        page.screenshot(path=OUT / "browser-notebook-00.png")
        assert not page.locator("[data-mime-type='application/vnd.jupyter.stderr']").count()
        assert not page.locator(".jp-RenderedText[data-mime-type*=error]").count()
        assert errors == []


def test_a_saved_slider_works_from_a_file_with_the_network_off(tmp_path):
    colours = [np.full((90, 120, 3), value, np.uint8) for value in (0, 120, 250)]
    one = player.make_player(colours, ["a", "b", "c"], what="x", alt="One.", caption="1")
    two = player.make_player(colours, ["d", "e", "f"], what="y", alt="Two.", caption="2")
    both = player.Player(fragment=one.fragment + two.fragment + one.fragment, title="both")
    path = both.save(tmp_path / "both.html")
    with browser(offline=True) as (page, errors):
        page.goto(f"file://{path}")
        sliders, words = page.locator("input[type=range]"), page.locator("output")
        sliders.nth(1).focus()
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        assert [words.nth(i).inner_text() for i in range(3)] == ["a", "f", "a"]
        assert looks(page, "figure:nth-of-type(2) img").mean() > 200
        assert looks(page, "figure:nth-of-type(1) img").mean() < 50
        assert sliders.nth(1).get_attribute("aria-valuetext") == "f"
        assert page.locator("img").nth(1).get_attribute("alt") == "Two. Now: f."
        page.keyboard.press("Home")
        page.locator("button").nth(1).click()
        page.wait_for_function("() => document.querySelectorAll('output')[1].textContent === 'f'")
        page.emulate_media(reduced_motion="reduce")
        assert page.locator("button:visible").count() == 0
        assert errors == []
