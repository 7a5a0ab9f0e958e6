"""A run watched in JupyterLab: stopped and resumed by keyboard, filmed, and seen to its end."""

import pytest
from jupyter_browser import browser, open_notebook, run_all, server, wait_idle, write_notebook
from test_browser import OUT
from test_browser import pytestmark as browsers

pytestmark = [*browsers, pytest.mark.slow]

CELL = """
import revolver_lab as rvl
from revolver_lab.lab import watch_film
from revolver_lab.methods import Method
from revolver_lab.runs import Plan, Run
from revolver_lab.schedule import Schedule

watch_film.EVERY = 1.0
short = Schedule(alpha_step=0.25, xi=0.6, episodes_per_phase=8, final_episodes=8)
plan = Plan(
    robot="cheetah-front-leg", seeds=[0, 1], steps=STEPS, evaluate_every=4800, evaluate_episodes=2,
    methods=[Method(name="quick", schedule=short),
             Method(name="raw", schedule=short, expert=False)],
)
run = Run(plan, root="runs")
rvl.lab.watch(run)
"""


def says(page, word: str, seconds: float) -> None:
    """Waits until the state of the run is told with a word."""
    page.wait_for_function(
        """word => [...document.querySelectorAll("[role=status]")]
        .some(line => line.textContent.includes(word))""",
        arg=word, timeout=1000 * seconds,
    )  # fmt: skip


def press(page, name: str) -> None:
    button = page.locator("button.jupyter-button", has_text=name).last
    button.focus()
    page.keyboard.press("Enter")


def no_errors(page, errors) -> None:
    assert not page.locator("[role=alert]").count()
    assert not page.locator("[data-mime-type='application/vnd.jupyter.stderr']").count()
    assert errors == []


def test_a_run_is_stopped_and_resumed_by_keyboard_filmed_and_seen_to_its_end(tmp_path):
    write_notebook(tmp_path / "lab.ipynb", CELL.replace("STEPS", "28_800"))
    with server(tmp_path) as address, browser() as (page, errors):
        open_notebook(page, address, "lab.ipynb")
        run_all(page)
        page.wait_for_selector("img[alt*='quick: 2 learners']", timeout=120_000)
        press(page, "Stop")
        press(page, "Stop")
        says(page, "stopped; Resume", 60)
        page.wait_for_selector("img[alt*='moved by the policy of']", timeout=60_000)  # a film
        press(page, "Resume")
        says(page, "training", 30)
        OUT.mkdir(exist_ok=True)
        page.screenshot(path=OUT / "browser-watch.png")
        says(page, "finished", 300)
        page.wait_for_selector("img[alt*='finished. quick: 2 learners at alpha 1.00']")
        page.screenshot(path=OUT / "browser-watch-finished.png")
        no_errors(page, errors)


def test_a_cell_that_waits_keeps_the_widgets_of_the_cell_before_up_to_date(tmp_path):
    write_notebook(tmp_path / "lab.ipynb", CELL.replace("STEPS", "28_800"), "run.wait().methods")
    with server(tmp_path) as address, browser() as (page, errors):
        open_notebook(page, address, "lab.ipynb")
        run_all(page)
        page.wait_for_selector("img[alt*='training, ']", timeout=120_000)
        wait_idle(page, 300)
        says(page, "finished", 5)
        assert page.get_by_text("('quick', 'raw')").count()
        no_errors(page, errors)
