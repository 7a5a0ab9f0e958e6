"""The schedule: beta in its window, alpha ends at exactly 1, impossible settings refused."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from revolver_lab.errors import SettingsError
from revolver_lab.methods import METHODS
from revolver_lab.schedule import Adaptive, Schedule


@given(st.floats(0.001, 1.0))
def test_alpha_grows_by_alpha_step_and_ends_at_exactly_one(step):
    alphas = Schedule(alpha_step=step, xi=0.0).alphas
    gaps = np.diff(alphas)
    assert alphas[0] == 0.0
    assert alphas[-1] == 1.0
    assert np.allclose(gaps[:-1], step, atol=1e-9)
    assert 0 < gaps[-1] <= step + 1e-9


def test_the_course_path_is_the_sum_of_its_steps():
    assert Schedule(alpha_step=0.04).alphas == tuple(round(0.04 * k, 12) for k in range(26))


@given(st.floats(0, 1), st.floats(0.05, 1))
def test_beta_is_drawn_from_alpha_to_alpha_plus_xi_cut_at_one(alpha, xi):
    schedule = Schedule(alpha_step=0.04, xi=xi)
    rng = np.random.default_rng(0)
    betas = np.array([schedule.draw(alpha, rng) for _ in range(200)])
    high = min(alpha + xi, 1.0)
    assert (betas >= alpha).all()
    assert (betas <= high).all()
    # mean of a uniform, within five standard errors
    assert abs(betas.mean() - (alpha + high) / 2) <= 5 * (high - alpha) / math.sqrt(12 * 200)


def test_the_deterministic_variant_draws_alpha_itself():
    assert Schedule(xi=0.0).draw(0.36, np.random.default_rng(0)) == 0.36


@given(st.floats(0, 1), st.sampled_from([0.0, 0.12, 0.3]))
def test_the_papers_window_begins_exactly_at_alpha(alpha, xi):
    low, high = Schedule(alpha_step=0.04, xi=xi).kept(alpha)
    assert low == alpha
    assert high == alpha + xi


def test_a_wider_window_reaches_backwards():
    assert np.allclose(Schedule(xi=0.12, window=0.33).kept(0.5), (0.29, 0.62))
    assert Schedule(window=math.inf).kept(0.5)[0] == -math.inf


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"alpha_step": 0.0}, "alpha_step = 0.0"),
        ({"alpha_step": math.nan}, "alpha_step = nan"),
        ({"alpha_step": 1.5, "xi": 0.0}, "alpha_step = 1.5"),
        ({"xi": 0.03}, "l_k < xi"),
        ({"xi": 1.5}, "xi = 1.5"),
        ({"xi": -0.1}, "xi = -0.1"),
        ({"episodes_per_phase": 0}, "episodes_per_phase = 0"),
        ({"final_episodes": 0}, "final_episodes = 0"),
        ({"shaping": math.inf}, "shaping = inf"),
        ({"window": 0.05}, "window = 0.05"),
        ({"alpha_start": 1.2}, "alpha from 1.2"),
        ({"alpha_end": 0.5, "alpha_start": 0.6}, "to 0.5"),
        ({"adaptive": Adaptive(episodes_limit=4)}, "episodes_limit = 4"),
        ({"adaptive": 3}, "adaptive = 3"),
        ({"episodes_per_phase": 2.5}, "episodes_per_phase = 2.5"),
        ({"episodes_per_phase": None}, "episodes_per_phase = None"),
        ({"phase_steps": True}, "phase_steps = True"),
        ({"latest": "all"}, "latest = 'all'"),
        ({"short_phases": 1}, "short_phases = 1"),
        ({"window": math.nan}, "window = nan"),
        ({"xi": "wide"}, "xi = 'wide'"),
        ({"shaping_form": ["absolute"]}, "shaping_form = ['absolute']"),
    ],
)
def test_settings_that_cannot_work_are_refused_by_name(settings, text):
    with pytest.raises(SettingsError) as caught:
        Schedule(**settings)
    assert text in str(caught.value)
    assert "Allowed" in str(caught.value)


def test_a_phase_shorter_than_an_episode_is_refused():
    with pytest.raises(SettingsError, match="shorter than an episode"):
        Schedule(episodes_per_phase=7).check(simulations=8, episode_steps=200)
    with pytest.raises(SettingsError, match="shorter than an episode"):
        Schedule(episodes_per_phase=8, final_episodes=2).check(simulations=8, episode_steps=200)
    Schedule(episodes_per_phase=8).check(simulations=8, episode_steps=200)


def test_a_phase_counted_in_steps_ends_after_them_and_is_not_shorter_than_an_episode():
    schedule = Schedule(phase_steps=1600, final_episodes=8)
    schedule.check(simulations=8, episode_steps=200)
    assert not schedule.phase_over(0.2, [], [], steps=1599)
    assert schedule.phase_over(0.2, [], [], steps=1600)
    assert not schedule.phase_over(1.0, [1.0] * 7, [], steps=9999)  # the last counts episodes
    with pytest.raises(SettingsError, match="shorter than an episode"):
        Schedule(phase_steps=1599).check(simulations=8, episode_steps=200)
    Schedule(phase_steps=1599, short_phases=True).check(simulations=8, episode_steps=200)


def test_a_fixed_phase_ends_after_its_episodes_whatever_they_return():
    schedule = Schedule(episodes_per_phase=3, final_episodes=5)
    assert not schedule.phase_over(0.2, [0.0] * 2, [100.0])
    assert schedule.phase_over(0.2, [0.0] * 3, [100.0])
    assert not schedule.phase_over(1.0, [0.0] * 4, [100.0])
    assert schedule.phase_over(1.0, [0.0] * 5, [100.0])


def test_an_adaptive_phase_waits_until_it_is_nearly_as_good_as_those_before():
    adaptive = Adaptive(ratio=0.7, memory=2, episodes_limit=20)
    schedule = Schedule(episodes_per_phase=4, adaptive=adaptive)
    assert schedule.phase_over(0.0, [0.0] * 4, [])  # nothing to compare with
    assert not schedule.phase_over(0.2, [60.0] * 4, [10.0, 90.0, 110.0])
    assert schedule.phase_over(0.2, [0.0, 0.0, 70.0, 70.0, 70.0, 71.0], [10.0, 90.0, 110.0])
    assert schedule.phase_over(0.2, [0.0] * 20, [100.0])
    # returns below zero: a drop of 30 % of the size is allowed there too
    assert schedule.phase_over(0.2, [-120.0] * 4, [-100.0])
    assert not schedule.phase_over(0.2, [-140.0] * 4, [-100.0])


@pytest.mark.parametrize(
    "settings",
    [{"ratio": 0.0}, {"ratio": 1.1}, {"ratio": "most"}, {"memory": 0}, {"memory": 2.5},
     {"episodes_limit": math.inf}],
)  # fmt: skip
def test_adaptive_settings_that_cannot_work_are_refused(settings):
    with pytest.raises(SettingsError):
        Adaptive(**settings)


def test_methods_are_configurations_of_one_loop():
    assert METHODS["direct"].schedule.alphas == METHODS["scratch"].schedule.alphas == (1.0,)
    assert not METHODS["scratch"].expert
    assert METHODS["deterministic"].schedule.xi == 0
    assert METHODS["revolver"].schedule.alphas[-1] == 1.0
    for row in METHODS.values():  # equal numbers of episodes
        assert sum(map(row.schedule.episodes, row.schedule.alphas)) == 360


def test_no_phase_may_be_shorter_than_an_episode_however_long_the_last_one_is():
    with pytest.raises(SettingsError, match="a phase of 2 episodes"):
        Schedule(episodes_per_phase=2, final_episodes=8).check(simulations=8, episode_steps=200)
    Schedule(episodes_per_phase=8, final_episodes=8).check(simulations=8, episode_steps=200)


def test_an_adaptive_phase_may_have_no_more_episodes_than_a_fixed_one():
    schedule = Schedule(episodes_per_phase=8, adaptive=Adaptive(episodes_limit=8))
    assert not schedule.phase_over(0.2, [0.0] * 7, [100.0])
    assert schedule.phase_over(0.2, [0.0] * 8, [100.0])


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"shaping": -20.5}, "shaping = -20.5"),
        ({"alpha_step": 0.1, "xi": 0.1}, "l_k < xi"),
    ],
)
def test_the_ends_of_what_is_allowed_are_where_they_are_said_to_be(settings, text):
    with pytest.raises(SettingsError, match=text):
        Schedule(**settings)
    Schedule(shaping=-20.0)
    assert Adaptive(ratio=1.0).ratio == 1.0
