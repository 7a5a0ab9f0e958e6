"""The command line: thin, and errors in one line with exit code 2."""

import os
import subprocess
import sys

import pytest
from PIL import Image

import revolver_lab as rvl
from revolver_lab import _gl, cli
from revolver_lab.errors import SettingsError

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
NAME = "cheetah-front-leg"
SMALL = ["--width", "48", "--height", "32"]


def test_list_names_every_robot(capsys):
    assert cli.main(["list"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in shown] == rvl.names()


def test_doctor_names_the_renderer_and_mends_in_one_line(capsys):
    cli.main(["doctor"])
    shown = capsys.readouterr().out
    assert _gl.choose().title in shown or "nothing that draws" in shown
    assert "mujoco 3.17" in shown
    for line in shown.splitlines():
        if line.startswith("--"):
            following = shown.split(line + "\n")[1].splitlines()[0]
            assert following.strip()


@needs_gl
def test_a_strip_and_films_from_the_shell(tmp_path, capsys):
    strip, film = str(tmp_path / "x.png"), str(tmp_path / "x.gif")
    assert cli.main(["strip", NAME, "--alpha", "0", "1", "-o", strip, *SMALL]) == 0
    assert Image.open(strip).width == 2 * 48 + 4
    assert cli.main(["gif", NAME, "--fps", "2", "-o", film, *SMALL]) == 0
    assert Image.open(film).n_frames > 2
    assert capsys.readouterr().out.split() == ["wrote", strip, "wrote", film]


@needs_gl
def test_a_film_of_the_shipped_policy(tmp_path):
    try:
        rvl.load_expert(NAME)
    except rvl.errors.PolicyFileError:
        pytest.skip("no expert is shipped yet")
    film = str(tmp_path / "x.gif")
    words = ["--policy", "expert", "--alpha", "0", "1", "--steps", "4", "-o", film, *SMALL]
    assert cli.main(["gif", NAME, *words]) == 0
    assert Image.open(film).width == 2 * 48 + 4


@pytest.mark.parametrize(
    "words",
    [
        ["strip", "cheetah-frontleg", "-o", "x.png"],
        ["strip", NAME, "-o", "x.txt"],
        ["strip", NAME, "-o", "no/such/folder/x.png"],
        ["gif", NAME, "-o", "x.gif", "--alpha", "0"],
        ["gif", NAME, "-o", "x.gif", "--policy", "no-such-file"],
        ["evaluate", NAME, "--policy", "no-such-file"],
        ["transfer", NAME, "--method", "magic"],
    ],
)
def test_errors_are_one_line_and_code_2(words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("revolver-lab: ")
    assert len(said.err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_training_without_torch_says_what_to_install():
    with (
        pytest.raises(rvl.errors.MissingExtraError, match=r"revolver-lab\[train\]"),
        cli._training(),
    ):
        raise ModuleNotFoundError("No module named 'torch'", name="torch")
    with pytest.raises(SettingsError), cli._training():
        raise SettingsError("a", "b", "c")


def test_a_broken_choice_of_opengl_breaks_pictures_only(tmp_path):
    env = os.environ | {"MUJOCO_GL": "osmesa-9", "XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-m", "revolver_lab.cli"]
    listed = subprocess.run([*command, "list"], env=env, capture_output=True, text=True)
    assert listed.returncode == 0, listed.stderr
    # A strip of a registered robot would be shown from its recording; a film has to be drawn.
    words = ["gif", NAME, "-o", str(tmp_path / "x.gif")]
    drawn = subprocess.run([*command, *words], env=env, capture_output=True, text=True)
    assert drawn.returncode == 2
    assert not (tmp_path / "x.gif").exists()
    assert "MUJOCO_GL=osmesa-9" in drawn.stderr
    assert len(drawn.stderr.splitlines()) == 1
