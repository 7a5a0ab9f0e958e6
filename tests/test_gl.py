"""Choosing OpenGL: by probing, once, without a word on the way out."""

import _ctypes
import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec

import pytest

from revolver_lab import _gl, _versions
from revolver_lab.errors import MissingExtraError
from revolver_lab.lab import gl

POLE = (
    "<mujoco><worldbody><body name='pole'><joint name='h' axis='0 1 0'/>"
    "<geom name='rod' type='capsule' fromto='0 0 0 0 0 1' size='.05'/></body></worldbody></mujoco>"
)
needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")


@pytest.fixture
def unasked(monkeypatch, tmp_path):
    """A process that has chosen nothing yet, with a cache folder of its own."""
    monkeypatch.setattr(_gl, "_chosen", None)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    return monkeypatch


def run(code, **environment):
    """Run code in a fresh Python; returns (stdout, stderr)."""
    env = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=env | environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr.strip()


def answer(**devices):
    """A stand-in for the subprocess: the backends named draw, others do not."""
    asked = []

    def ask(backend):
        asked.append(backend)
        return (devices[backend], "") if backend in devices else ("", "no library")

    return ask, asked


@pytest.mark.parametrize(
    ("devices", "backend", "title"),
    [
        ({"egl": "NVIDIA H200", "osmesa": "llvmpipe"}, "egl", "GPU EGL"),
        ({"egl": "llvmpipe (LLVM 15)", "osmesa": "llvmpipe"}, "egl", "Mesa EGL"),
        ({"osmesa": "llvmpipe"}, "osmesa", "OSMesa"),
        ({}, "disabled", "none"),
    ],
)
def test_the_best_backend_that_draws_is_chosen(unasked, devices, backend, title):
    unasked.setattr(_gl, "_ask", answer(**devices)[0])
    renderer = _gl.choose()
    assert (renderer.backend, renderer.title) == (backend, title)
    assert os.environ["MUJOCO_GL"] == backend


def test_an_answer_that_works_is_asked_for_once_and_a_failure_again(unasked):
    ask, asked = answer(egl="llvmpipe")
    unasked.setattr(_gl, "_ask", ask)
    assert _gl.probe() == _gl.probe()
    assert asked == ["egl"]
    _gl.cache_file().unlink()
    ask, asked = answer()
    unasked.setattr(_gl, "_ask", ask)
    assert not _gl.probe().works
    _gl.probe()
    assert asked == ["egl", "osmesa"] * 2
    assert not _gl.cache_file().exists()


@pytest.mark.parametrize("damage", ["", "{", "[]", "null", '{"key": 1}', "\0\0"])
def test_a_damaged_cache_file_is_ignored(unasked, damage):
    unasked.setattr(_gl, "_ask", answer(egl="llvmpipe")[0])
    _gl.probe()
    _gl.cache_file().write_text(damage)
    assert _gl.probe().works
    assert json.loads(_gl.cache_file().read_text())["renderer"]["device"] == "llvmpipe"


@pytest.mark.parametrize("field", ["device", "backend"])
def test_a_cached_answer_with_a_wrong_field_is_ignored(unasked, field):
    unasked.setattr(_gl, "_ask", answer(egl="llvmpipe")[0])
    _gl.probe()
    stored = json.loads(_gl.cache_file().read_text())
    stored["renderer"][field] = 7
    _gl.cache_file().write_text(json.dumps(stored))
    assert _gl.probe().backend == "egl"


def test_another_version_asks_again(unasked):
    ask, asked = answer(egl="llvmpipe")
    unasked.setattr(_gl, "_ask", ask)
    _gl.probe()
    unasked.setattr(_gl, "installed", lambda name: "9.9")
    _gl.probe()
    assert asked == ["egl", "egl"]


def test_a_cache_folder_that_cannot_be_written_is_no_error(unasked, tmp_path):
    (tmp_path / "revolver_lab").write_text("a file where the folder should be")
    unasked.setattr(_gl, "_ask", answer(egl="llvmpipe")[0])
    assert _gl.probe().works


def test_the_users_choice_is_kept_if_it_works(unasked):
    unasked.setenv("MUJOCO_GL", "osmesa")
    unasked.setattr(_gl, "_ask", answer(egl="a GPU", osmesa="llvmpipe")[0])
    renderer = _gl.choose()
    assert (renderer.backend, renderer.chosen_by) == ("osmesa", "user")


def test_a_users_choice_that_does_not_work_is_told_and_nothing_else_breaks(unasked):
    unasked.setenv("MUJOCO_GL", "osmesa")
    unasked.setattr(_gl, "_ask", answer(egl="a GPU")[0])
    assert not _gl.choose().works
    assert os.environ["MUJOCO_GL"] == "disabled"
    with pytest.raises(MissingExtraError, match=r"osmesa: no library.*unset MUJOCO_GL"):
        gl.ensure()


def test_without_any_opengl_the_error_has_the_line_that_mends_it(unasked):
    unasked.setattr(_gl, "_ask", answer()[0])
    with pytest.raises(MissingExtraError, match="apt-get install -y libegl1"):
        gl.ensure()


def test_without_any_opengl_everything_but_frames_works():
    code = (
        "import revolver_lab as rvl; print(rvl.names()[0]); evolve = rvl.load(rvl.names()[0])\n"
        "evolve(0.5); print(rvl.lab.show(evolve.matching).alt[:3])\n"
        "print(rvl.lab.strip(evolve, [0, 1]).shape[1], rvl.lab.explore(evolve).error)\n"
        "try: rvl.lab.film(evolve, 'x.gif')\n"
        "except rvl.errors.MissingExtraError as e: print('OpenGL' in str(e))"
    )
    out, _ = run(code, MUJOCO_GL="disabled")
    assert out.splitlines() == ["cheetah-front-leg", "Two", "484 None", "True"]


# Contexts of mujoco, dm_control and ours, in every order, none of them ever closed.
STAGE = "from revolver_lab.lab.frames import Stage; s = Stage(m, width=32, height=32); s.frame()\n"
PHYSICS = (
    "from dm_control.mujoco import Physics; p = Physics.from_xml_string(POLE); p.render(32, 32)\n"
)
PLAIN = "r = mujoco.Renderer(m, 32, 32); r.update_scene(mujoco.MjData(m)); r.render()\n"
ORDERS = [STAGE, STAGE + PHYSICS + "s.frame()\n", PHYSICS + STAGE, PHYSICS + STAGE + PLAIN]


@needs_gl
@pytest.mark.parametrize("order", ORDERS, ids=["ours", "ours-theirs", "theirs-ours", "all"])
def test_nothing_is_said_at_exit_whatever_was_left_open(order):
    code = f"from revolver_lab import _gl; _gl.choose(); import mujoco; POLE = {POLE!r}\n"
    code += "m = mujoco.MjModel.from_xml_string(POLE)\n"
    assert run(code + order) == ("", "")


@needs_gl
def test_pictures_of_ours_and_of_dm_control_can_be_interleaved():
    import mujoco
    from dm_control.mujoco import Physics

    from revolver_lab.lab.frames import Stage

    model = mujoco.MjModel.from_xml_string(POLE)
    physics = Physics.from_xml_string(POLE)
    before = physics.render(48, 64).copy()
    with Stage(model, width=64, height=48) as stage:
        ours = stage.frame()
        assert (physics.render(48, 64) == before).all()
        assert (stage.frame() == ours).all()
    assert (physics.render(48, 64) == before).all()


@needs_gl
def test_the_library_of_torchs_compiler_is_loaded_ahead_of_opengls_and_nothing_imported(tmp_path):
    library = tmp_path / "triton" / "_C" / "libtriton.so"
    library.parent.mkdir(parents=True)
    shutil.copy(_ctypes.__file__, library)  # any library will do
    (tmp_path / "triton" / "__init__.py").write_text("raise SystemExit('imported')")
    code = "from revolver_lab import _gl; _gl.choose(); maps = open('/proc/self/maps').read()\n"
    code += f"import sys; print({str(library)!r} in maps, 'OpenGL' in sys.modules)"
    assert run(code, PYTHONPATH=str(tmp_path)) == ("True False", "")


@needs_gl
@pytest.mark.skipif(find_spec("triton") is None, reason="torch for the CPU has no compiler")
def test_a_step_of_torchs_optimiser_after_a_picture_ends_well():
    code = f"import revolver_lab as rvl; rvl.lab.strip(rvl.Evolution({POLE!r}, {POLE!r}), [0])\n"
    code += "import torch; w = torch.zeros(1, requires_grad=True); w.grad = torch.ones(1)\n"
    code += "torch.optim.Adam([w]).step(); print('stepped')"
    assert run(code)[0] == "stepped"


def test_another_version_of_the_pair_is_refused_in_one_line(monkeypatch):
    found = {"mujoco": "3.17.2", "dm-control": "1.0.50"}
    monkeypatch.setattr(_versions, "installed", lambda name: found[name])
    _versions.check()
    for name, version in (("mujoco", "3.18.0"), ("dm-control", "1.0.5"), ("mujoco", "missing")):
        monkeypatch.setattr(_versions, "installed", lambda n, **_: (found | {name: version})[n])  # noqa: B023
        with pytest.raises(MissingExtraError, match="pip install 'mujoco"):
            _versions.check()
