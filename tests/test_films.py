"""Strips and films: the right pictures, small, whole or not at all, without a system ffmpeg."""

import os
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from natural_puck import EXPERT, Reach, puck
from PIL import Image

import revolver_lab as rvl
from revolver_lab import _gl
from revolver_lab.errors import AlphaError, MissingExtraError, SettingsError, UnknownNameError
from revolver_lab.evolution.matching import match
from revolver_lab.evolution.reading import read_robot
from revolver_lab.lab import captions, encoders, films, trees
from revolver_lab.lab.frames import Stage
from revolver_lab.lab.rollouts import Rollout

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
SIZE = {"width": 64, "height": 48}
NAME = "cheetah-front-leg"


@pytest.fixture(scope="module")
def evolve():
    return rvl.load(NAME)


def rollout(evolve, steps=5, **changes):
    settings = {"alpha": 0.5, "title": "half way", "dt": 0.1} | changes
    qpos = np.linspace(0, 1, steps)[:, None] * np.ones(9)
    return Rollout(evolve=evolve, qpos=qpos, rewards=np.arange(steps) / 2, **settings)


def gif_frames(path):
    with Image.open(path) as gif:
        for number in range(gif.n_frames):
            gif.seek(number)
            yield np.array(gif.convert("RGB")).astype(int)


def gradient(number):
    """A frame of few colours in which a square moves."""
    frame = np.zeros((40, 60, 3), np.uint8)
    frame[..., 0], frame[..., 2] = 4 * np.arange(60), 90
    frame[10:20, number : number + 10] = (250, 200, 20)
    return frame


@needs_gl
def test_a_strip_shows_each_alpha_as_a_stage_draws_it(evolve, tmp_path):
    path = tmp_path / "strip.png"
    picture = rvl.lab.strip(evolve, (0.0, 1.0), path=path, **SIZE)
    with Stage(evolve, **SIZE) as stage:
        first, second = stage.frame(0.0), stage.frame(1.0)
    assert (picture[:48, :64] == first).all()
    assert (picture[:48, -64:] == second).all()
    assert (first != second).any()
    assert (np.array(Image.open(path)) == picture).all()


@needs_gl
def test_a_name_shows_what_its_evolution_does_and_one_alpha_is_one_picture(evolve, tmp_path):
    named, given = [rvl.lab.strip(robot, 0.5, **SIZE) for robot in (NAME, evolve)]
    assert (named == given).all()
    assert (named == rvl.lab.strip(evolve, [0.5], **SIZE)).all()
    for robot, path in ((NAME, "a.gif"), (evolve, "b.gif")):
        rvl.lab.film(robot, tmp_path / path, fps=2, **SIZE)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    pages = [rvl.lab.static_slider(robot, 2, 64, 48) for robot in (NAME, evolve)]
    assert pages[0].title == pages[1].title
    assert rvl.lab.explore(NAME, rvl.load_expert(NAME)).explorer.evolve is evolve
    with pytest.raises(UnknownNameError, match=NAME):
        rvl.lab.static_slider("cheetah-fron-leg")


@needs_gl
def test_a_film_of_an_evolution_goes_there_and_back(evolve):
    frames = list(films.film_frames(evolve, **SIZE, fps=2))
    pictures = [frame[:48] for frame in frames]
    assert len(frames) == 1 + 5 + 1 + 5
    assert (pictures[0] == pictures[-1]).all()
    assert (pictures[1:6] == np.array(pictures[7:])[::-1]).all()
    assert (pictures[0] != pictures[6]).any()


@needs_gl
def test_rollouts_stand_side_by_side_in_real_time_and_the_shorter_one_waits(evolve):
    long, short = rollout(evolve), rollout(evolve, steps=2, alpha=1.0, dt=0.05, title="end")
    frames = list(films.film_frames([long, short], **SIZE, fps=20))
    assert len(frames) == 10  # 5 poses, each shown for 0.1 s
    with Stage(evolve, **SIZE) as stage:
        for number in (0, 1, 7):
            frame = frames[number]
            assert (frame[:48, :64] == stage.frame(0.5, long.qpos[number // 2])).all()
            assert (frame[:48, -64:] == stage.frame(1.0, short.qpos[min(number, 1)])).all()


@needs_gl
def test_at_half_speed_there_are_twice_the_frames_of_the_same_poses(evolve):
    run = rollout(evolve)
    usual, slow = (list(films.film_frames([run], **SIZE, fps=20, speed=s)) for s in (1.0, 0.5))
    assert len(slow) == 2 * len(usual) == 20
    assert all((slow[2 * n] == usual[n]).all() for n in range(10))


def test_a_goal_is_counted_in_the_caption_and_held_for_more_steps_than_needed_is_success(evolve):
    goal = rollout(evolve, held=np.array([0, 0, 1, 2, 3]), goal_steps=2)
    assert [films.achieved(goal, row) for row in (1, 2, 3, 4)] == [
        "goal not held", "goal held 1 step", "goal held 2 steps", "goal held 3 steps: success",
    ]  # fmt: skip
    assert [goal.success(row) for row in (1, 3, 4)] == [False, False, True]
    assert goal.success()
    assert films.achieved(rollout(evolve), 3) == "reward 3"
    assert films.achieved(rollout(evolve)) == "reward 5"
    assert not rollout(evolve).success()


@needs_gl
def test_gif_and_mp4_come_without_a_system_ffmpeg(evolve, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    done = rvl.lab.film([rollout(evolve)], tmp_path / "x.gif", **SIZE, fps=10)
    assert len(list(gif_frames(done))) == 5
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    done = rvl.lab.film(rollout(evolve), tmp_path / "x.mp4", width=65, height=49, fps=10)
    frames, _ = ffmpeg.count_frames_and_secs(str(done))
    assert frames == 5


def test_a_gif_shows_the_frames_it_was_given(tmp_path):
    frames = [gradient(number) for number in range(40)]
    path = encoders.write_movie(iter(frames), tmp_path / "x.gif", fps=20)
    shown = list(gif_frames(path))
    assert len(shown) == 40
    for given, seen in zip(frames, shown, strict=True):
        assert np.abs(given - seen).max() <= 12  # 255 colours for all
        assert np.abs(given - seen).mean() < 2
    with Image.open(path) as gif:
        assert gif.info["duration"] == 50
        assert gif.info["loop"] == 0


def test_pixels_that_do_not_change_cost_next_to_nothing(tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, (100, 100, 3), dtype=np.uint8)
    one = encoders.write_movie([noise], tmp_path / "one.gif", fps=10).stat().st_size
    many = encoders.write_movie([noise] * 50, tmp_path / "many.gif", fps=10).stat().st_size
    assert many < 1.7 * one


@pytest.mark.parametrize("ending", ["gif", "mp4"])
def test_a_film_that_fails_leaves_what_was_there(tmp_path, ending):
    if ending == "mp4":
        pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / f"x.{ending}"
    path.write_text("the film of yesterday")

    def frames():
        yield gradient(0)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        encoders.write_movie(frames(), path, 20)
    assert path.read_text() == "the film of yesterday"
    assert os.listdir(tmp_path) == [path.name]


def test_an_mp4_without_imageio_ffmpeg_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match="pip install imageio-ffmpeg"):
        encoders.write_movie([gradient(0)], tmp_path / "x.mp4", 20)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda e, d: rvl.lab.film(e, d / "x.avi"), r"'x.avi'\. Allowed: \.gif or \.mp4"),
        (lambda e, d: rvl.lab.strip(e, path=d / "x.gif"), r"Allowed: \.png"),
        (lambda e, d: rvl.lab.film(e, d / "no" / "x.gif"), "folder"),
        (lambda e, d: rvl.lab.film(e, d / "x.gif", fps=200), "fps = 200"),
        (lambda e, d: rvl.lab.film(e, d / "x.gif", speed=0), "speed = 0"),
        (lambda e, d: rvl.lab.film([], d / "x.gif"), "no rollouts"),
        (lambda e, d: rvl.lab.strip(e, ()), "no alphas"),
        (lambda e, d: rollout(e, alpha=0.5, dt=0.0), "dt = 0.0"),
        (lambda e, d: encoders.write_movie([], d / "x.gif", 20), "no frames"),
        (lambda e, d: rvl.lab.show(e), "a Evolution|an Evolution"),
        (lambda e, d: rvl.lab.film(e, d / "x.gif", fps=None), "fps = None"),
        (lambda e, d: rvl.lab.film(e, d / "x.gif", speed="1"), "speed = '1'"),
        (lambda e, d: rvl.lab.compare([rollout(e)], fps=0), "fps = 0"),
        (lambda e, d: rvl.lab.compare([rollout(e)], fps=1e300), r"fps = 1e\+300"),
        (lambda e, d: rvl.lab.compare([rollout(e)], speed=0.0), r"speed = 0\.0"),
        (lambda e, d: rvl.lab.record(np.tanh, e, 0.0, steps="x"), "steps = 'x'"),
        (lambda e, d: rvl.lab.record(np.tanh, e, 0.0, seed=np.nan), "seed = nan"),
        (lambda e, d: rvl.lab.strip(None), "robot = None"),
        (lambda e, d: rvl.lab.strip(e.model(0.0)), "robot = <mujoco"),
        (lambda e, d: rvl.lab.film(None, d / "x.gif"), "NoneType"),
        (lambda e, d: rvl.lab.film([e], d / "x.gif"), "Evolution"),
        (lambda e, d: rvl.lab.film([NAME], d / "x.gif"), "str"),
        (lambda e, d: rvl.lab.record("expert", e, 0.0), "policy = 'expert'"),
        (lambda e, d: rvl.lab.explore(e, "expert"), "policy = 'expert'"),
        (lambda e, d: rvl.lab.explore(1.0), "robot = 1.0"),
        (lambda e, d: rvl.load([NAME]), r"name = \['cheetah"),
    ],
)
def test_what_cannot_work_is_refused_before_a_frame_is_drawn(evolve, tmp_path, call, words):
    with pytest.raises(SettingsError, match=words):
        call(evolve, tmp_path)
    assert not list(Path(tmp_path).iterdir())


def test_rollouts_are_checked(evolve):
    with pytest.raises(AlphaError):
        rollout(evolve, alpha=1.5)
    with pytest.raises(SettingsError, match=r"\(T, nq\)"):
        Rollout(evolve=evolve, alpha=0, qpos=np.zeros((3, 9)), rewards=np.zeros(4))
    with pytest.raises(SettingsError, match=r"held of shape \(4,\)"):
        rollout(evolve, held=np.zeros(4))


def test_a_record_is_the_episode_of_the_environment(evolve):
    from revolver_lab.envs.single import RobotEnv

    def policy(observation):
        return np.tanh(observation[:6])

    kept = rvl.lab.record(policy, NAME, 0.3, seed=4, steps=20)
    env = RobotEnv(NAME, alpha=0.3)
    observation, _ = env.reset(seed=4)
    assert (kept.qpos[0] == env.simulation.data.qpos).all()
    for row in range(1, 21):
        observation, reward, *_ = env.step(policy(observation))
        assert (kept.qpos[row] == env.simulation.data.qpos).all()
        assert kept.rewards[row] == reward
    assert kept.qpos.shape == (21, 9)
    assert kept.dt == pytest.approx(0.05)


def test_a_record_of_a_hand_says_for_how_long_the_goal_was_held():
    kept = rvl.lab.record(rvl.load_expert("adroit-door"), "adroit-door", 0.0, seed=0)
    # The sparse reward is 1 for every step in which the door is open: an independent count.
    assert (kept.held == kept.rewards.cumsum()).all()
    assert kept.goal_steps == 25
    assert kept.success() == (kept.score > 25)
    assert rvl.lab.record(lambda o: np.zeros(6), NAME, 0.0, steps=2).held is None


def test_a_record_on_a_robot_of_ones_own_is_judged_by_ones_own_task():
    kept = rvl.lab.record(EXPERT, puck(), 0.0, task=Reach(), seed=1)
    assert kept.rewards[1:].tolist() == (np.abs(kept.qpos[1:, 0]) < 0.3).astype(float).tolist()
    assert kept.success()
    assert not rvl.lab.record(EXPERT, puck(), 1.0, task=Reach(), seed=1).success()
    with pytest.raises(SettingsError, match="not registered"):
        rvl.lab.record(EXPERT, puck(), 0.0)


def test_recording_an_unknown_robot_lists_the_near_ones():
    with pytest.raises(UnknownNameError, match="cheetah-front-leg"):
        rvl.lab.record(lambda o: o, "cheetah-fron-leg", 0.0)


def test_a_caption_that_is_too_long_is_cut_and_keeps_its_size():
    short, long = captions.bar(120, "a", "b"), captions.bar(120, "long " * 40, "b")
    assert short.shape == long.shape
    assert (short != long).any()


# Two robots of which each has something that the other lacks.
SOURCE = """<mujoco><worldbody><body name='torso'><geom size='.1'/>
<body name='leg'><joint name='hip'/><geom size='.1'/></body>
<body name='tail'><joint name='wag' type='slide'/><geom size='.1'/></body></body></worldbody>
</mujoco>"""
TARGET = """<mujoco><worldbody><body name='torso'><geom size='.1'/>
<body name='leg'><joint name='hip'/><geom size='.1'/>
<body name='foot'><joint name='ankle'/><geom size='.1'/></body></body></body></worldbody>
</mujoco>"""


def test_a_drawn_matching_shows_every_body_on_both_sides_and_marks_what_was_created():
    matching = match(read_robot(SOURCE), read_robot(TARGET))
    left, right = trees.padded_tree(matching, 0), trees.padded_tree(matching, 1)
    assert {n.key for n in left} == {n.key for n in right}
    assert {n.body for n in left if n.created} == {"foot"}
    assert {n.body for n in right if n.created} == {"tail"}
    drawing = rvl.lab.show(matching)
    words = {text.get_text() for axes in drawing.figure.axes for text in axes.texts}
    assert {"torso", "leg", "tail", "foot"} <= words
    assert "body foot in the source" in drawing.alt
    assert "body tail in the target" in drawing.alt
    assert drawing.alt in drawing._repr_html_()


def test_no_two_names_of_a_drawn_tree_overlap(tmp_path):
    drawing = rvl.lab.show(rvl.load("humanoid-length-mass").matching)
    assert drawing.save(tmp_path / "tree.png").stat().st_size > 1000
    canvas = FigureCanvasAgg(drawing.figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    for axes in drawing.figure.axes:
        boxes = [text.get_window_extent(renderer) for text in axes.texts]
        for number, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:number])
