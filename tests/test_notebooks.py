"""Notebooks: paired, stripped, short, announced, with one claim and words for every figure."""

import ast
import itertools
import re
import statistics
from pathlib import Path

import jupytext
import nbformat
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import SettingsError
from revolver_lab.runs.course import LESSONS, MODE

FOLDER = Path(__file__).parent.parent / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
DRAWN = {"strip", "Figure"}
"""What makes pixels without words; a cell that draws them has to say them."""

every_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)


def _code(path: Path) -> list[str]:
    return [c.source for c in nbformat.read(path, 4).cells if c.cell_type == "code"]


def _called(source: str) -> set[str]:
    calls = [node.func for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    return {f.attr if isinstance(f, ast.Attribute) else getattr(f, "id", "") for f in calls}


def test_every_notebook_has_its_script_and_every_script_its_notebook():
    assert [p.stem for p in NOTEBOOKS] == sorted(p.stem for p in FOLDER.glob("*.py"))
    assert {p.stem for p in NOTEBOOKS} >= {"00_meet_the_robots", "01_points_on_a_path"}


@every_notebook
def test_notebook_and_script_say_the_same(path):
    notebook, script = nbformat.read(path, 4), jupytext.read(path.with_suffix(".py"))
    cells = [[(c.cell_type, c.source) for c in book.cells] for book in (notebook, script)]
    assert cells[0] == cells[1], f"run: jupytext --to ipynb notebooks/{path.stem}.py"
    assert notebook.metadata.jupytext.formats == "ipynb,py:percent"


@every_notebook
def test_outputs_and_widget_state_are_stripped(path):
    notebook = nbformat.read(path, 4)
    nbformat.validate(notebook)
    assert set(notebook.metadata) <= {"jupytext", "kernelspec", "language_info"}
    assert notebook.metadata.kernelspec.name == "python3"
    for cell in notebook.cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
        assert not cell.metadata


@every_notebook
def test_cells_are_short_and_hold_no_machinery(path):
    cells = _code(path)
    assert statistics.median(len(cell.splitlines()) for cell in cells) <= 7
    assert max(len(cell.splitlines()) for cell in cells) <= 25
    nodes = [node for cell in cells for node in ast.walk(ast.parse(cell))]
    assert not any(isinstance(node, ast.ClassDef) for node in nodes)
    assert sum(isinstance(node, ast.FunctionDef) for node in nodes) <= 1


@every_notebook
def test_every_cell_is_announced(path):
    cells = nbformat.read(path, 4).cells
    kinds = [cell.cell_type for cell in cells]
    assert kinds[0] == kinds[-1] == "markdown"
    for before, cell in itertools.pairwise(cells):
        if cell.cell_type == "code":
            assert before.cell_type == "markdown", cell.source


@every_notebook
def test_one_claim_and_one_number_that_must_hold(path):
    words = "\n".join(c.source for c in nbformat.read(path, 4).cells if c.cell_type == "markdown")
    assert len(re.findall(r"\*\*The claim:", words)) == 1
    assert words.count("## The number that must hold") == 1
    *others, last = _code(path)
    lines = last.splitlines()
    assert lines[-1].startswith("assert ")
    assert lines[-2].startswith("print(")
    assert not any("assert" in cell for cell in others)


@every_notebook
def test_no_formula_waits_for_the_network(path):
    # MathJax comes from a server: a page opened without the network would show bare LaTeX.
    text = path.with_suffix(".py").read_text()
    assert "$" not in text
    assert "http" not in text


@every_notebook
def test_only_a_lesson_trains(path):
    # A lesson trains in worker processes, or not at all: the mode is chosen outside the notebook.
    called = set.union(*map(_called, _code(path)))
    assert not {"transfer", "train_expert", "start", "Population"} & called
    assert not any(isinstance(node, ast.If) for c in _code(path) for node in ast.walk(ast.parse(c)))


@every_notebook
def test_a_notebook_takes_its_own_lesson_and_its_own_exercises(path):
    code = "\n".join(_code(path))
    for name in re.findall(r"rvl\.lab\.lesson\((.*?)\)", code):
        assert name == f'"{path.stem}"', "no mode, and no other notebook's rows"
    assert (path.stem in LESSONS) == ("rvl.lab.lesson(" in code)
    if path.stem[:2] != "00":
        assert f"from revolver_lab.exercises import {path.stem[3:]} as checks" in code
        assert set(re.findall(r"\bchecks\.(\w+)\(", code)) == {"one", "two", "three"}


@every_notebook
def test_a_cell_that_draws_says_what_is_drawn(path):
    for cell in _code(path):
        if _called(cell) & DRAWN:
            assert _called(cell) & {"picture", "Drawing"}, cell


def test_pictures_and_drawings_carry_their_words():
    from matplotlib.figure import Figure

    words = 'A "black" square.'
    shown = [
        rvl.lab.picture(np.zeros((4, 4, 3), dtype=np.uint8), words),
        rvl.lab.Drawing(figure=Figure(figsize=(1, 1)), alt=words),
    ]
    for figure in shown:
        assert 'alt="A &quot;black&quot; square."' in figure._repr_html_()


def test_a_picture_from_a_file_is_that_file(tmp_path):
    path = tmp_path / "dot.gif"
    path.write_bytes(b"GIF89a")
    assert rvl.lab.picture(path, "A dot.").data == b"GIF89a"
    assert rvl.lab.picture(path, "A dot.").kind == "image/gif"
    with pytest.raises(SettingsError, match="of type NoneType"):
        rvl.lab.picture(None, "Nothing.")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("shown", "alt", "message"),
    [
        (np.zeros((4, 4, 3), dtype=np.uint8), " ", "Say what the picture shows"),
        (np.zeros((4, 4)), "A square.", "Take them from rvl.lab.strip"),
        ("missing.png", "A square.", "a file that exists"),
        ("picture.txt", "A square.", "Change its ending"),
    ],
)
def test_a_picture_without_words_or_pixels_is_refused(shown, alt, message):
    with pytest.raises(SettingsError, match=message):
        rvl.lab.picture(shown, alt)


def test_binder_installs_the_package_without_torch():
    folder = FOLDER.parent / "binder"
    requirements = (folder / "requirements.txt").read_text()
    assert "-e .[lab]" in requirements
    assert "train" not in re.sub(r"#.*", "", requirements)
    assert {"libegl1", "libegl-mesa0"} <= set((folder / "apt.txt").read_text().split())


def _executed(path: Path) -> nbformat.NotebookNode:
    """The notebook after running it, with one cell more that says what was imported and held."""
    from nbclient import NotebookClient

    notebook = nbformat.read(path, 4)
    # Not getrusage: its peak starts with what pytest held when it forked the kernel.
    asked = "import re, sys\nprint('torch' in sys.modules, " + (
        "int(re.search(r'VmHWM:\\s*(\\d+)', open('/proc/self/status').read())[1]) // 1000)"
    )
    notebook.cells.append(nbformat.v4.new_code_cell(asked))
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(FOLDER)}}).execute()
    return notebook


@pytest.mark.slow
@every_notebook
def test_an_executed_notebook_is_light_and_every_image_has_words(path, monkeypatch):
    monkeypatch.setenv(MODE, "fast")
    *cells, last = _executed(path).cells
    torch, megabytes = last.outputs[0].text.split()
    assert torch == "False"
    assert int(megabytes) < 1200
    for output in (o for cell in cells for o in cell.get("outputs", [])):
        data = output.get("data", {})
        assert not any(kind.startswith("image/") for kind in data), "an image without words"
        for tag in re.findall(r"<img\b[^>]*>", data.get("text/html", "")):
            assert re.search(r'alt="[^"]{20,}"', tag)


@pytest.mark.slow
@every_notebook
def test_a_notebook_runs_to_its_end_without_opengl(path, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disabled")
    monkeypatch.setenv(MODE, "recorded")
    assert _executed(path).cells
