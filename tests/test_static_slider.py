"""The slider without a kernel: small, self-contained, whole or not at all."""

import base64
import io
import json
import re

import numpy as np
import pytest
from PIL import Image

import revolver_lab as rvl
from revolver_lab import _gl
from revolver_lab.errors import MissingExtraError, SettingsError
from revolver_lab.lab import player, standins
from revolver_lab.lab.frames import Stage
from revolver_lab.lab.recording import record_frames

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
NAME = "cheetah-front-leg"


@pytest.fixture(scope="module")
def evolve():
    return rvl.load(NAME)


@pytest.fixture
def no_gl(monkeypatch):
    monkeypatch.setattr(_gl, "choose", lambda: _gl.Renderer(backend="disabled", trouble=("x",)))


def data(made):
    return json.loads(
        re.search(r'<script type="application/json">(.*?)</script>', made.fragment)[1]
    )


def frames(made):
    for text in data(made)["frames"]:
        yield np.array(Image.open(io.BytesIO(base64.b64decode(text))))


def noise(count, width=64, height=48):
    rng = np.random.default_rng(0)
    return list(rng.integers(0, 255, (count, height, width, 3), dtype=np.uint8))


@needs_gl
def test_its_frames_are_the_robots_along_alpha(evolve):
    made = rvl.lab.static_slider(evolve, frames=3, width=96, height=72)
    shown = list(frames(made))
    with Stage(evolve, width=96, height=72) as stage:
        for picture, alpha in zip(shown, (0.0, 0.5, 1.0), strict=True):
            assert np.abs(picture.astype(int) - stage.frame(alpha)).mean() < 6
    assert [label.split(",")[0] for label in data(made)["labels"]] == [
        "alpha 0", "alpha 0.5", "alpha 1",
    ]  # fmt: skip


def test_a_page_asks_the_network_for_nothing_and_says_what_it_shows():
    made = player.make_player(noise(2), ["a", "b"], what="alpha", alt="A robot.", caption="c")
    assert not re.search(r'(src|href)="(?!data:)', made.fragment)
    assert "http" not in made.fragment
    assert 'alt="A robot."' in made.fragment
    assert 'type="range"' in made.fragment
    assert 'aria-label="alpha"' in made.fragment
    assert "prefers-reduced-motion" in made.fragment
    assert " id=" not in made.fragment  # so that several on a page cannot collide


def test_names_cannot_break_the_page():
    evil = '</script><script>alert("x")</script> WIDTH DATA'
    made = player.make_player(noise(2), [evil, "b"], what=evil, alt=evil, caption=evil)
    assert made.fragment.count("<script") == 2
    assert data(made)["labels"][0] == evil


def test_the_quality_gives_way_before_the_size_does():
    pictures, labels = noise(4), list("abcd")
    told = {"what": "w", "alt": "a", "caption": "c"}
    best = player.make_player(pictures, labels, **told)
    less = player.make_player(pictures, labels, **told, max_bytes=len(best.fragment) + 2_000)
    assert len(less.fragment) < len(best.fragment)
    with pytest.raises(SettingsError, match="fewer or smaller"):
        player.make_player(pictures, labels, **told, max_bytes=11_000)


def test_a_page_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    made = player.make_player(noise(2), ["a", "b"], what="w", alt="a", caption="The <robot>")
    path = made.save(tmp_path / "slider.html")
    text = path.read_text()
    assert text.startswith("<!doctype html>")
    assert "<title>The &lt;robot&gt;</title>" in text
    assert made._repr_html_() in text
    with pytest.raises(SettingsError, match="html"):
        made.save(tmp_path / "slider.pdf")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["slider.html"]


def test_without_opengl_it_shows_the_recorded_robots_and_says_so(evolve, no_gl):
    made = rvl.lab.static_slider(evolve, frames=3, width=160, height=120)
    first, _, last = frames(made)
    wanted = standins.recording(NAME)[-1][::2, ::2]
    assert np.abs(last[:90].astype(int) - wanted[:90]).mean() < 12
    assert (first != last).any()
    assert (np.abs(last[-10:].astype(int) - wanted[-10:]).max(axis=2) > 60).any()  # the note
    with pytest.raises(MissingExtraError, match=r"OpenGL"):
        rvl.lab.static_slider(rvl.Evolution(ROD, ROD), frames=3)


ROD = """<mujoco><worldbody><body name='rod'><joint name='hinge' axis='0 1 0'/>
<geom name='rod' type='capsule' size='.1 1'/></body></worldbody></mujoco>"""


@needs_gl
def test_a_recording_can_be_made_again(tmp_path, monkeypatch):
    evolve = rvl.Evolution(ROD, ROD.replace(".1 1", ".1 2"), name="rod")
    path = record_frames(evolve, tmp_path / "rod.webp", frames=2)
    monkeypatch.setattr(standins, "asset_folder", lambda kind: tmp_path)
    assert standins.recording("rod").shape == (2, 240, 320, 3)
    assert path.stat().st_size < 60_000
    assert standins.recording("../rod") is None
    with pytest.raises(SettingsError, match="webp"):
        record_frames(evolve, tmp_path / "rod.png")
    with pytest.raises(SettingsError, match="from 2"):
        record_frames(evolve, tmp_path / "rod.webp", frames=1)


@pytest.mark.parametrize("bad", [1, 999, 4.5, None])
def test_a_number_of_frames_that_cannot_work_is_refused(evolve, bad):
    with pytest.raises(SettingsError, match="from 2"):
        rvl.lab.static_slider(evolve, frames=bad)
