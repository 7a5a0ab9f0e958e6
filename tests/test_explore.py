"""The explorer: few draws for many events, the last one always, and no error lost."""

import asyncio
import io

import mujoco
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

import revolver_lab as rvl
from revolver_lab import _gl
from revolver_lab.errors import AlphaError, SettingsError, UnknownNameError
from revolver_lab.lab import explorer as explorers
from revolver_lab.lab import facts, standins
from revolver_lab.lab.explore import facts_table
from revolver_lab.lab.explorer import Explorer
from revolver_lab.lab.frames import Stage
from revolver_lab.lab.pacing import Pacer

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
NAME = "cheetah-front-leg"


@pytest.fixture(scope="module")
def evolve():
    return rvl.load(NAME)


@pytest.fixture
def small(monkeypatch):
    """Small pictures: these tests are about what is drawn, not how well."""
    monkeypatch.setattr(explorers, "QUICK", (32, 24))
    monkeypatch.setattr(explorers, "FULL", (64, 48))


@pytest.fixture
def no_gl(monkeypatch):
    monkeypatch.setattr(_gl, "choose", lambda: _gl.Renderer(backend="disabled", trouble=("x",)))
    monkeypatch.setattr(standins, "_shared", type(standins._shared)())


def still(observation):
    return np.zeros(6)


def pixels(jpeg):
    return np.array(Image.open(io.BytesIO(jpeg)))


def watched(events, **settings):
    """Runs `events(pacer)` in an event loop; what was drawn: (latest value, full?)."""
    drawn = []

    async def main():
        pacer = Pacer(lambda full: drawn.append((pacer.value, full)), settle=0.02, **settings)
        pacer.value = None
        await events(pacer)
        await pacer.rest()

    asyncio.run(main())
    return drawn


def test_a_burst_of_200_events_is_drawn_once_quickly_and_once_in_full():
    async def burst(pacer):
        for pacer.value in range(200):
            pacer.ask()

    assert watched(burst) == [(199, False), (199, True)]


def test_of_events_that_arrive_while_drawing_only_the_last_is_drawn():
    async def arrivals(pacer):
        for pacer.value in range(200):
            pacer.ask()
            await asyncio.sleep(0)  # each is a message of its own

    drawn = watched(arrivals)
    assert drawn[-1] == (199, True)
    assert len(drawn) <= 4
    assert drawn[0] == (0, False)  # the first of all is not kept waiting


def test_a_long_drag_is_watched_and_not_only_its_end():
    async def drag(pacer):
        for pacer.value in range(100):
            pacer.ask()
            await asyncio.sleep(0.008)

    drawn = watched(drag)
    assert len(drawn) >= 3
    assert drawn[-1] == (99, True)


def test_without_an_event_loop_it_is_drawn_at_once():
    drawn = []
    Pacer(drawn.append).ask()
    assert drawn == [True]


@needs_gl
def test_the_slider_shows_the_robot_of_its_alpha_quickly_and_then_in_full(evolve, small):
    app = rvl.lab.explore(evolve)
    sizes = []
    app.image.observe(lambda change: sizes.append(pixels(change["new"]).shape[:2]), "value")

    async def drag():
        for alpha in np.linspace(0, 1, 200):
            app.slider.value = alpha
        await app.pacer.rest()

    asyncio.run(drag())
    assert sizes == [(24, 32), (48, 64)]
    assert "alpha 1.00" in app.words.value
    with Stage(evolve, width=64, height=48) as stage:
        wanted = stage.frame(1.0)
    assert np.abs(pixels(app.image.value).astype(int) - wanted).mean() < 6  # JPEG
    app.close()


@needs_gl
def test_the_play_button_sweeps_alpha_there_and_back_without_a_policy(evolve, small):
    app = rvl.lab.explore(evolve)
    seen = []
    for tick in (0, 50, 100, 150, 200):
        app.on_play({"new": tick})
        seen.append(app.slider.value)
    assert seen == [0.0, 0.5, 1.0, 0.5, 0.0]


@needs_gl
def test_the_play_button_shows_what_the_policy_does_on_this_robot(evolve, small, monkeypatch):
    recorded = []
    keep = explorers.record
    monkeypatch.setattr(
        explorers, "record", lambda *a, **k: (recorded.append(a[2]), keep(*a, **k, steps=8))[1]
    )
    app = rvl.lab.explore(evolve, still, alpha=0.5)
    standing = app.image.value
    app.on_play({"new": 8})
    app.on_play({"new": 4})
    assert recorded == [0.5]
    assert "0.2 s" in app.words.value
    assert app.play.max == 8
    assert app.image.value != standing
    app.slider.value = 0.6  # another robot: it stands until it is played again
    assert "reward" not in app.words.value
    assert app.error is None


@needs_gl
def test_a_broken_callback_shows_its_error_until_something_works(evolve, small, monkeypatch):
    app = rvl.lab.explore(evolve, lambda observation: np.zeros(99))
    app.on_play({"new": 3})
    assert app.error is not None
    assert 'role="alert"' in app.trouble.value
    assert type(app.error).__name__ in app.trouble.value
    assert "Traceback" in app.trouble.value
    app.on_alpha({"new": 0.0})
    assert app.error is None
    assert app.trouble.value == ""


@needs_gl
def test_a_camera_can_be_chosen_and_one_context_serves_every_explorer(evolve, small):
    first, second = rvl.lab.explore(evolve), rvl.lab.explore(evolve)
    assert list(first.camera.options) == ["fit", "side", "back"]
    before = first.image.value
    first.camera.value = "back"
    assert first.image.value != before
    assert standins.shared_stage(evolve) is standins.shared_stage(second.explorer.evolve)


@pytest.fixture
def short(monkeypatch):
    """Episodes of nine steps."""
    keep = explorers.record
    monkeypatch.setattr(explorers, "record", lambda *a, **k: keep(*a, **k, steps=8))


EVENTS = st.lists(
    st.one_of(
        st.tuples(st.just("slide"), st.integers(0, 100)),
        st.tuples(st.just("camera"), st.sampled_from(["fit", "side", "back"])),
        st.tuples(st.just("play"), st.integers(0, 8)),
        st.tuples(st.just("settle"), st.none()),
    ),
    max_size=12,
)


@needs_gl
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(events=EVENTS, plays=st.booleans())
def test_whatever_is_clicked_in_whatever_order_the_last_of_it_is_shown(
    evolve, small, short, events, plays
):
    app = rvl.lab.explore(evolve, still if plays else None)
    alpha, camera, step = 0.0, "fit", None

    async def click():
        nonlocal alpha, camera, step
        for what, value in events:
            if what == "slide":
                moved = value / 100 != app.alpha
                app.slider.value = alpha = value / 100
                step = None if moved and plays else step
            elif what == "camera":
                app.camera.value = camera = value
            elif what == "play":
                app.on_play({"new": value})
                alpha, step = (alpha, value) if plays else (value / 100, None)
            else:
                await app.pacer.rest()
        await app.pacer.rest()

    asyncio.run(click())
    wanted = Explorer(evolve, still if plays else None).picture(alpha, camera, step=step)
    assert app.error is None
    assert app.words.value == f'<div role="status">{wanted.words}</div>'
    assert app.image.value == wanted.jpeg
    assert app.facts.value == facts_table(app.explorer.facts(alpha))
    app.close()


@needs_gl
def test_only_a_few_stages_stay_open(monkeypatch):
    closed = []
    monkeypatch.setattr(standins, "_shared", type(standins._shared)())
    monkeypatch.setattr(standins, "Stage", lambda evolve, samples: type(
        "S", (), {"close": lambda self: closed.append(evolve)})())  # fmt: skip
    for number in range(6):
        standins.shared_stage(number)
    assert closed == [0, 1]


def test_without_opengl_the_recorded_robot_stands_in_and_says_so(evolve, no_gl):
    app = rvl.lab.explore(evolve, still)
    at_zero = app.image.value
    app.slider.value = 1.0
    assert app.image.value != at_zero
    assert "recorded" in app.words.value
    app.on_play({"new": 3})
    assert "reward" in app.words.value
    assert app.error is None
    assert list(app.camera.options) == ["fit"]


def test_without_opengl_a_robot_that_was_not_recorded_still_has_its_numbers(no_gl):
    rod = "<mujoco><worldbody><body name='rod'><joint name='hinge' axis='0 1 0'/>"
    rod += "<geom name='rod' type='capsule' size='.1 {}'/></body></worldbody></mujoco>"
    app = rvl.lab.explore(rvl.Evolution(rod.format(1), rod.format(2)))
    assert ">2.2<" in app.facts.value
    assert app.error is None


@pytest.mark.parametrize("name", rvl.names())
def test_every_registered_robot_is_recorded(name):
    pictures = standins.recording(name)
    assert pictures.shape == (21, 240, 320, 3)
    assert (pictures[0] != pictures[-1]).any()


@needs_gl
def test_a_recording_is_the_robot_as_it_is_drawn_today(evolve):
    with Stage(evolve, width=320, height=240) as stage:
        for index in (0, 20):
            difference = stage.frame(index / 20).astype(int) - standins.recording(NAME)[index]
            assert np.abs(difference).mean() < 8  # WebP, and other OpenGLs


def test_facts_are_those_of_a_fresh_model(evolve):
    found = {(fact.kind, fact.name): fact for fact in facts.Facts(evolve).at(0.3)}
    model = evolve.model(0.3)
    mass = found[facts.MASS, "all bodies"]
    assert mass.now == pytest.approx(mujoco.mj_getTotalmass(model))
    changed = {k: f for k, f in found.items() if k[0] == facts.PARAMETER}
    assert len(changed) == evolve.theta_changed.sum()
    for name, value, moves in zip(evolve.theta_names, evolve.theta(0.3), evolve.theta_changed):
        if moves:
            fact = changed[facts.PARAMETER, name.split(" [")[0]]
            assert fact.now == pytest.approx(value)
            assert fact.unit == name.split(" [")[1].rstrip("]")
    shin = found[facts.LIMB, "fshin"]
    assert shin.now == pytest.approx(2 * model.geom("fshin").size[:2].sum())
    assert shin.source > shin.now > shin.target


def test_names_in_the_table_are_text():
    fact = facts.Fact(kind=facts.LIMB, name="<b>", source=0, now=0, target=0, unit="m")
    assert "&lt;b&gt;" in facts_table([fact])


def test_bad_input_is_refused_before_anything_is_shown(evolve):
    with pytest.raises(AlphaError):
        rvl.lab.explore(evolve, alpha=2)
    with pytest.raises(UnknownNameError, match=NAME):
        rvl.lab.explore("cheetah-fron-leg")
    with pytest.raises(SettingsError, match="no policy"):
        explorers.Explorer(evolve).rollout(0.0)
