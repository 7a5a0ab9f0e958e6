"""Watching a run: it tells how things are, and no order of clicks or accidents breaks it."""

import asyncio
import dataclasses
import io
import shutil
import subprocess
import sys
import time
from pathlib import Path

import nbformat.v4 as v4
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

import revolver_lab as rvl
from revolver_lab import _gl
from revolver_lab.errors import SettingsError
from revolver_lab.files import write_json
from revolver_lab.lab import standins, watch_film, watch_view, watching
from revolver_lab.lab.trees import Drawing
from revolver_lab.lab.watch_figure import History, evaluated
from revolver_lab.lab.watch_front_end import LIVE, somebody_looks
from revolver_lab.lab.watching import Watching
from revolver_lab.methods import Method
from revolver_lab.runs import LearnerStatus, Plan, Run, Status, store
from revolver_lab.schedule import Schedule
from revolver_lab.stats import band

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
SHORT = Schedule(alpha_step=0.5, xi=0.6, episodes_per_phase=8, final_episodes=8)
PLAN = Plan(
    robot="cheetah-front-leg", seeds=[0, 1], steps=4800, evaluate_every=2400, evaluate_episodes=2,
    methods=[Method(name="quick", schedule=SHORT),
             Method(name="raw", schedule=SHORT, expert=False)],
)  # fmt: skip


def learner(seed=0, method="quick", **changes):
    usual = LearnerStatus(
        method=method, seed=seed, alpha=0.5, phase=1, phases=3, steps=2400, episode_return=7.0,
        evaluations=((2400, 10.0 + seed),), over=False, failure="",
    )  # fmt: skip
    return dataclasses.replace(usual, **changes)


BOTH = (learner(0), learner(1))


class FakeRun:
    """A run whose workers take as many looks to stop as one likes."""

    def __init__(self, folder, state="new", learners=BOTH, slow=8):
        self.plan, self.folder, self.watchers = PLAN, Path(folder), []
        self.state, self.learners, self.slow = state, learners, slow
        self.message, self.starts, self.waits = "", 0, 0
        write_json(self.folder / store.CONFIG, PLAN.to_json())

    @property
    def flag(self):
        return self.folder / store.STOP

    def status(self):
        if self.state == "running" and self.flag.exists():
            self.waits += 1
            if self.waits > self.slow:
                self.state = "stopped"
        return Status(state=self.state, learners=tuple(self.learners), steps=4800,
                      steps_planned=19200, seconds=12.0, message=self.message)  # fmt: skip

    def start(self, *, processes=2, every=60.0):
        if self.state not in ("running", "finished"):
            write_json(self.folder / store.CONFIG, PLAN.to_json())
            self.flag.parent.mkdir(exist_ok=True)
            self.flag.unlink(missing_ok=True)
            self.state, self.waits = "running", 0
            self.starts += 1
        return self

    def stop(self, *, patience=30.0):
        assert patience == 0, "a button must not wait"
        self.flag.touch()
        return self

    def wait(self):
        self.state = "finished"


@pytest.fixture
def unpainted(monkeypatch):
    """Figures are put together, but not turned into pixels, which is what takes long."""
    monkeypatch.setattr(Drawing, "_bytes", lambda self, kind: b"")


@pytest.fixture
def fake(tmp_path, unpainted):
    return FakeRun(tmp_path / "run").start()


@pytest.fixture
def live(monkeypatch):
    monkeypatch.setenv(LIVE, "1")


@pytest.fixture
def nobody(monkeypatch):
    monkeypatch.setenv(LIVE, "0")


def shown(run):
    app = Watching(run)
    app.begin()
    return app


def until(app, state, looks=20):
    for _ in range(looks):
        app.look()
        if watch_view._WORDS[state] in app.words.value:
            return
    raise AssertionError(app.words.value)


def test_stopping_twice_stops_once_and_resuming_while_it_stops_is_not_lost(fake):
    app = shown(fake)
    app.on_stop(app.stop)
    assert "stopping" in app.words.value
    app.on_stop(app.stop)
    app.on_resume(app.resume)
    assert "go on" in app.words.value
    assert fake.starts == 1  # not yet: its workers are still writing
    for _ in range(10):
        app.look()
    assert (fake.state, fake.starts) == ("running", 2)
    assert not fake.flag.exists()
    assert app.error is None


def test_a_stop_after_a_resume_wins(fake):
    app = shown(fake)
    app.on_stop(app.stop)
    app.on_resume(app.resume)
    app.on_stop(app.stop)
    until(app, "stopped")
    app.look()
    assert fake.starts == 1
    app.on_stop(app.stop)  # stopped already
    assert not any(word in app.trouble.value for word in ("Error", "alert"))
    app.on_resume(app.resume)
    assert (fake.state, fake.starts) == ("running", 2)


def test_a_run_stopped_by_somebody_else_is_not_started_again(fake):
    app = shown(fake)
    fake.stop(patience=0)
    until(app, "stopped")
    app.look()
    assert fake.starts == 1


CLICKS = st.lists(st.sampled_from(["stop", "resume", "look", "film", "another's stop", "delete"]))


@given(clicks=CLICKS, slow=st.integers(0, 4))
@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_in_whatever_order_its_buttons_are_pressed_the_last_of_them_wins(
    tmp_path, unpainted, clicks, slow
):
    run = FakeRun(tmp_path / str(len(list(tmp_path.iterdir()))), slow=slow).start()
    app = shown(run)
    wanted = "running"
    for click in clicks:
        if click == "stop":
            app.on_stop(app.stop)
            wanted = "stopped"
        elif click == "resume":
            app.on_resume(app.resume)
            wanted = "running"
        elif click == "film":
            app.box.value = not app.box.value
        elif click == "another's stop" and not run.flag.exists() and run.state == "running":
            run.stop(patience=0)
            wanted = "stopped"
        elif click == "delete" and run.state == "stopped":
            shutil.rmtree(run.folder)
            run.state = "new"
        app.look()
        assert app.error is None
    for _ in range(slow + 3):
        app.look()
    assert run.state in ((wanted,) if run.folder.exists() else ("new",))
    assert run.starts <= 1 + clicks.count("resume")
    app.close()


def test_a_failed_run_says_why_and_resume_tries_again(fake):
    fake.state, fake.message = "failed", "The <disk> is full."
    app = shown(fake)
    assert "The &lt;disk&gt; is full." in app.words.value
    app.on_resume(app.resume)
    assert fake.state == "running"


def test_a_learner_that_failed_is_named_with_its_reason(fake):
    fake.learners = (learner(0), learner(1, failure="a loss is not finite"))
    app = shown(fake)
    assert "quick, seed 1 (a loss is not finite)" in app.words.value
    assert "1 failed and not in the mean" in app.figure.value


def test_a_folder_deleted_under_it_is_said_and_can_be_begun_anew(fake):
    app = shown(fake)
    shutil.rmtree(fake.folder)
    app.look()
    assert "stopping" in app.words.value  # its workers have not noticed yet
    app.on_stop(app.stop)
    fake.state = "new"
    app.look()
    assert "gone" in app.words.value
    assert app.error is None
    app.on_resume(app.resume)
    assert (fake.state, fake.starts) == ("running", 2)


def test_files_that_vanish_during_a_look_are_no_error_but_broken_ones_are_shown(fake, monkeypatch):
    app = shown(fake)

    def broken():
        raise SettingsError("a torn file", "a whole one", "Restore it.")

    monkeypatch.setattr(fake, "status", broken)
    app.look()
    assert isinstance(app.error, SettingsError)
    assert 'role="alert"' in app.trouble.value
    shutil.rmtree(fake.folder)
    app.look()
    assert "gone" in app.words.value
    assert app.error is None
    assert app.trouble.value == ""


def test_an_error_of_a_button_stays_until_the_button_works(fake, monkeypatch):
    app = shown(fake)
    fake.state = "stopped"
    with monkeypatch.context() as patch:
        patch.setattr(fake, "start", lambda **_: 1 / 0)
        app.on_resume(app.resume)
        app.look()
        assert "ZeroDivisionError" in app.trouble.value
    app.on_resume(app.resume)
    assert app.error is None
    assert app.trouble.value == ""


def test_a_finished_run_is_drawn_and_looked_at_no_more(fake, monkeypatch):
    fake.state = "finished"
    app = shown(fake)
    assert "finished" in app.words.value
    assert "Cost:" in app.figure.value
    assert app.over
    assert app.stop.disabled
    monkeypatch.setattr(fake, "status", lambda: 1 / 0)
    app.look()
    app.on_wait(Status(state="finished", learners=(), steps=1, steps_planned=1, seconds=1.0))
    assert app.error is None


def test_it_looks_every_second_until_it_is_closed_and_the_run_goes_on(fake, monkeypatch):
    monkeypatch.setattr(watching, "POLL", 0.01)

    async def main():
        app = shown(fake)
        fake.state = "stopped"
        await asyncio.sleep(0.2)
        assert "stopped" in app.words.value
        fake.start()
        app.close()
        said = app.words.value
        await asyncio.sleep(0.1)
        assert app.words.value == said
        assert app._polling.cancelled()
        app.close()  # twice is fine
        return app

    app = asyncio.run(main())
    assert (fake.state, fake.watchers) == ("running", [])
    assert app.error is None


def test_the_figure_is_drawn_for_news_only(fake):
    app = shown(fake)
    app._again = 0.0
    before = app.figure.value
    app.look()
    assert app.figure.value is before
    fake.learners = (learner(0, alpha=1.0), learner(1))
    app.look()
    assert app.figure.value != before


def test_the_intervals_are_those_of_the_seeds_that_did_not_fail():
    some = [learner(0, evaluations=((100, 1.0), (200, 4.0))),
            learner(1, evaluations=((100, 3.0),)),
            learner(2, evaluations=((100, 99.0),), failure="x")]  # fmt: skip
    each = evaluated(some)
    wanted = band(np.array([[1.0], [3.0]]), resamples=2000)
    assert each.steps.tolist() == [100]  # the second point is not everybody's
    assert each.found.value.tolist() == [2.0]
    assert (each.found.low, each.found.high) == (wanted.low, wanted.high)
    assert each.left_out == 1
    assert evaluated([learner(0, evaluations=())]) is None


def test_the_figure_says_alpha_returns_seeds_and_cost_in_words(fake):
    fake.learners = (learner(0), learner(1, alpha=0.75), learner(0, "raw", evaluations=()))
    view = watch_view.View(fake)
    drawing = view.drawing(view.look())
    assert "25%" in drawing.alt
    assert "quick: 2 learners at alpha 0.50 to 0.75, return on the target 10.5 (" in drawing.alt
    assert "2 seeds) after 2400 steps" in drawing.alt
    assert "raw: 1 learner at alpha 0.50, not evaluated yet" in drawing.alt
    # Two evaluations of 2 episodes of 200 steps each; no file of an expert here.
    assert "7.2 k steps of training, 800 of evaluation" in drawing.alt
    assert 'alt="cheetah-front-leg: training' in drawing._repr_html_()


def test_training_returns_are_kept_as_they_pass(fake):
    history = History()
    for steps, value in ((100, 1.0), (100, 1.0), (50, 3.0), (200, None), (300, float("nan"))):
        fake.learners = (learner(0, steps=steps, episode_return=value),)
        history.see(fake.status())
    at, values = history.of("quick", 0)
    assert (at.tolist(), values.tolist()) == ([50, 100], [3.0, 1.0])
    assert history.of("quick", 9)[0].size == 0


@pytest.mark.parametrize("state", ["new", "running", "stopped", "failed", "finished"])
def test_every_state_is_drawn_even_with_no_learner_known(tmp_path, state, unpainted):
    run = FakeRun(tmp_path / "run", state=state, learners=())
    app = shown(run)
    assert app.error is None
    assert watch_view._WORDS[state] in app.words.value


def test_a_cell_run_again_takes_over_from_the_one_before(fake, live):
    first, second = rvl.lab.watch(fake), rvl.lab.watch(fake)
    assert first.over
    assert not second.over
    assert len(fake.watchers) == 1
    assert fake.starts == 1
    second.close()


def test_a_new_or_stopped_run_is_started_and_a_failed_one_is_not(tmp_path, live, unpainted):
    for state, starts in (("new", 1), ("stopped", 1), ("failed", 0), ("finished", 0)):
        run = FakeRun(tmp_path / state, state=state)
        rvl.lab.watch(run).close()
        assert run.starts == starts


def test_where_nobody_looks_it_waits_for_the_end_and_draws_it(tmp_path, nobody):
    drawing = rvl.lab.watch(FakeRun(tmp_path / "a"))
    assert isinstance(drawing, rvl.lab.Drawing)
    assert "finished" in drawing.alt
    drawing = rvl.lab.watch(FakeRun(tmp_path / "b"), wait=False)
    assert "training, 25%" in drawing.alt


def test_waiting_can_be_asked_for_in_a_front_end_too(tmp_path, live):
    assert "finished" in rvl.lab.watch(FakeRun(tmp_path / "run"), wait=True).alt


def test_plain_python_is_no_front_end_and_widgets_need_no_torch():
    code = (
        "import sys, revolver_lab as rvl; from revolver_lab.lab import watch, watching\n"
        "from revolver_lab.lab.watch_front_end import somebody_looks\n"
        "print(somebody_looks(), 'torch' in sys.modules, 'matplotlib' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "False"]


@pytest.mark.parametrize(("allowed", "live"), [(False, False), (True, True)])
def test_a_front_end_is_known_by_whether_it_may_be_asked_for_input(allowed, live, monkeypatch):
    class Shell:
        class kernel:
            @staticmethod
            def get_parent(channel):
                return {"content": {"allow_stdin": allowed}}

    monkeypatch.delenv(LIVE, raising=False)
    monkeypatch.setattr("IPython.core.getipython.get_ipython", lambda: Shell)
    assert somebody_looks() is live


@pytest.mark.parametrize("given", ["no/such/folder", 3, None])
def test_what_is_no_run_is_refused(given):
    with pytest.raises(SettingsError):
        rvl.lab.watch(given)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A run that was watched where nobody looks, and what was drawn."""
    run = Run(PLAN, root=tmp_path_factory.mktemp("runs"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(LIVE, "0")
        return run, rvl.lab.watch(run)


def test_a_real_run_is_trained_to_its_end_and_drawn_with_its_own_numbers(trained):
    run, drawing = trained
    results = run.results()
    assert "cheetah-front-leg: finished. quick: 2 learners at alpha 1.00" in drawing.alt
    for method in results.methods:
        mean = results.finals(method).mean()
        assert f"{method}: 2 learners at alpha 1.00, return on the target {mean:.3g} (" in (
            drawing.alt)  # fmt: skip
    cost = results.cost
    view = watch_view.View(run)
    told = view.cost(view.look())
    assert (told.steps, told.evaluation_steps, told.expert_steps) == (
        cost.steps, cost.evaluation_steps, cost.expert_steps)  # fmt: skip
    view.drawing(view.look())
    at, values = view.history.of("quick", 0)
    phases = results.of("quick")[0].phases
    assert at.tolist() == [phase["steps"] for phase in phases]
    assert values.tolist() == [phase["episode_return"] for phase in phases]


def film(filming, status):
    scene = filming.due(status)
    steps = filming.shoot(scene)
    count = 0
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value, count
        count += 1


@needs_gl
def test_the_policy_is_filmed_on_the_robot_that_it_has_come_to(trained, monkeypatch):
    run, _ = trained
    monkeypatch.setattr(watch_film, "_STEPS", 6)
    filming, status = watch_film.Filming(run), run.status()
    shot, pauses = film(filming, status)
    with Image.open(io.BytesIO(shot.data)) as gif:
        assert (gif.size, gif.n_frames) == ((240, 180), 4)  # 7 poses of 0.05 s, 10 a second
    assert pauses >= 4  # the kernel answers between frames
    assert "alpha 1.00, moved by the policy of quick, seed 0: reward" in shot.alt
    assert filming.due(status) is None  # nothing is new


def test_without_opengl_one_recorded_picture_stands_in_and_says_so(trained, monkeypatch):
    monkeypatch.setattr(_gl, "choose", lambda: _gl.Renderer(backend="disabled", trouble=("x",)))
    monkeypatch.setattr(standins, "_shared", type(standins._shared)())
    monkeypatch.setattr(watch_film, "_STEPS", 6)
    shot, _ = film(watch_film.Filming(trained[0]), trained[0].status())
    assert shot.kind == "image/png"
    assert "no OpenGL works here" in shot.alt


def test_an_episode_with_a_goal_is_filmed_whole_and_slowly_where_its_scene_stood(monkeypatch):
    shown = []

    class Seeing:
        """Notes what it is asked to draw."""

        def resize(self, *_):
            pass

        effects = resize

        def frame(self, alpha, qpos, places):
            shown.append((qpos, places))

    monkeypatch.setattr(watch_film, "shared_stage", lambda evolve: Seeing())
    take = rvl.lab.record(lambda o: np.zeros(28), "adroit-door", 1.0, seed=3)
    frames = list(watch_film._frames(take))
    assert len(frames) == 40  # 2 s, at half speed, 10 frames a second
    assert (shown[20][0] == take.qpos[100]).all()
    assert all((places == take.places).all() for _, places in shown)


def test_a_running_run_is_filmed_from_its_newest_checkpoint_now_and_then(trained, tmp_path):
    policy = next((trained[0].folder / store.POLICIES).glob("*"))
    run = FakeRun(tmp_path / "run", learners=BOTH).start()
    write_json(run.folder / store.SHARDS, {"shards": 2})
    filming = watch_film.Filming(run, every=0.0)
    assert filming.due(run.status()) is None  # no checkpoint yet
    for shard in (1, 0):
        work = store.shard_folder(run.folder, shard)
        work.mkdir(parents=True)
        shutil.copy(policy, work / store.CURRENT)
        time.sleep(0.02)
    scene = filming.due(run.status())
    assert (scene.learner.seed, scene.path.parent.name) == (0, "shard-0")
    next(filming.shoot(scene))
    assert filming.due(run.status()) is None
    run.learners = (learner(0, alpha=0.75), learner(1))
    assert filming.due(run.status()).learner.alpha == 0.75  # another robot
    filming._next = time.monotonic() + 60
    assert filming.due(run.status()) is None  # too early
    shutil.rmtree(run.folder)
    with pytest.raises(StopIteration):
        next(filming.shoot(scene))


def test_a_film_that_fails_is_shown_and_the_rest_goes_on(trained, fake, monkeypatch):
    app = shown(fake)
    monkeypatch.setattr(app.filming, "due", lambda status: "scene")
    monkeypatch.setattr(app.filming, "shoot", lambda scene: (1 / 0 for _ in "x"))
    app._looked = float("-inf")
    app.on_wait(fake.status())
    app.look()
    assert "ZeroDivisionError" in app.trouble.value
    assert "training" in app.words.value


@pytest.mark.parametrize("late", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_run_deleted_while_it_trains_ends_its_workers_and_stays_deleted(tmp_path, live, late):
    run = Run(dataclasses.replace(PLAN, steps=72_000, seeds=[0]), root=tmp_path)
    app = rvl.lab.watch(run)
    workers = list(run._workers)
    while late and not run.status().learners:
        time.sleep(0.05)
    shutil.rmtree(run.folder)
    for worker in workers:
        worker.wait(60)
    app.look()
    assert "gone" in app.words.value
    assert app.error is None
    assert not run.folder.exists()
    app.close()


@pytest.mark.slow
def test_a_run_opened_again_shows_the_training_returns_of_before(tmp_path):
    run = Run(dataclasses.replace(PLAN, steps=72_000, seeds=[0], methods=PLAN.methods[:1]),
              root=tmp_path).start()  # fmt: skip
    while not any(one.phase for one in run.status().learners):
        time.sleep(0.05)
    run.stop()
    again = watch_view.View(Run.open(run.folder))
    again.look()
    assert again.history.of("quick", 0)[0][0] == 1600  # its first phase: 8 episodes of 200 steps


@pytest.mark.slow
def test_executed_by_nbclient_it_trains_to_the_end_and_the_next_cell_reads_results(tmp_path):
    from nbclient import NotebookClient

    book = v4.new_notebook(cells=[v4.new_code_cell(text) for text in (
        "import revolver_lab as rvl; from revolver_lab.runs import Plan, Run\n"
        f"run = Run(Plan.from_json({PLAN.to_json()!r}), root={str(tmp_path)!r})\n"
        "rvl.lab.watch(run)", "run.results().methods",
    )])  # fmt: skip
    NotebookClient(book, timeout=120, kernel_name="python3").execute()
    assert "finished" in book.cells[0].outputs[-1]["data"]["text/html"]
    assert book.cells[1].outputs[-1]["data"]["text/plain"] == "('quick', 'raw')"
