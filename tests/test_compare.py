"""Policies side by side: one play button, real time, and what each earned."""

import dataclasses
import json
import re

import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab import _gl
from revolver_lab.errors import PolicyFileError, SettingsError, UnknownNameError
from revolver_lab.lab.explorer import Explorer
from revolver_lab.lab.films import film_frames
from revolver_lab.lab.rollouts import Rollout

needs_gl = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
SIZE = {"width": 48, "height": 36}


@pytest.fixture(scope="module")
def runs():
    evolve = rvl.load("cheetah-front-leg")
    return [
        Rollout(evolve=evolve, alpha=alpha, qpos=np.zeros((20, 9)), rewards=np.ones(20) * alpha,
                title=title, dt=0.05)
        for alpha, title in ((0.0, "expert"), (1.0, "carried"))
    ]  # fmt: skip


def data(made):
    return json.loads(
        re.search(r'<script type="application/json">(.*?)</script>', made.fragment)[1]
    )


@needs_gl
def test_all_are_shown_at_once_in_real_time_under_one_button(runs):
    made = rvl.lab.compare(runs, **SIZE, fps=10)
    shown = data(made)
    assert len(shown["frames"]) == 10  # 20 poses, 0.05 s each
    assert shown["pause"] == 100
    assert shown["labels"][-1] == "0.9 s"
    assert made.fragment.count("<button") == 1
    assert "expert earned 0; carried earned 20" in made.fragment


@needs_gl
def test_one_rollout_is_enough_and_names_its_alpha(runs):
    lone = Rollout(evolve=runs[0].evolve, alpha=0.5, qpos=np.zeros((2, 9)), rewards=np.ones(2))
    assert rvl.lab.compare(lone, **SIZE).title == "cheetah-front-leg: alpha 0.5"


@needs_gl
def test_a_rollout_with_a_title_stands_beside_one_without(runs, tmp_path):
    mixed = [runs[0], dataclasses.replace(runs[1], title="")]
    assert len(data(rvl.lab.compare(mixed, **SIZE, fps=10))["frames"]) == 10
    heights = [len(moment) for moment in film_frames(mixed, **SIZE)]
    assert len(set(heights)) == 1
    assert heights[0] > SIZE["height"]


def test_a_policy_of_another_robot_is_refused_before_it_acts():
    policy = rvl.load_expert("cheetah-front-leg")
    for play in (
        lambda: rvl.lab.record(policy, "ant-length-mass", 0.0),
        lambda: Explorer("ant-length-mass", policy),
    ):
        with pytest.raises(PolicyFileError, match=r"17 observations|18 observations"):
            play()


def test_a_task_that_does_not_exist_is_told_when_a_policy_is_to_be_explored():
    policy = rvl.load_expert("cheetah-front-leg")
    with pytest.raises(UnknownNameError, match="zz"):
        Explorer("cheetah-front-leg", policy, task="zz")


def test_without_opengl_the_recorded_robots_stand_while_rewards_go_on(runs, monkeypatch):
    monkeypatch.setattr(_gl, "choose", lambda: _gl.Renderer(backend="disabled", trouble=("x",)))
    shown = data(rvl.lab.compare(runs, width=200, height=150, fps=4))
    assert len(set(shown["frames"])) > 1


@pytest.mark.parametrize("bad", [[], [1], ["cheetah-front-leg"]])
def test_what_is_no_rollout_is_refused(bad):
    with pytest.raises(SettingsError, match=r"rvl.lab.record"):
        rvl.lab.compare(bad)
