"""Intervals and tests at the edges: few seeds, many tasks, every confidence."""

import math

import numpy as np
import pytest
import scipy.stats

from revolver_lab import stats
from revolver_lab.errors import SettingsError

# where this is pasted, rng is there already
rng = np.random.default_rng(0)


def test_the_runs_of_each_task_are_drawn_on_their_own():
    # What one task gains the other loses, run by run: drawn together, the mean would never move.
    gain = np.random.default_rng(1).normal(size=40)
    found = stats.interval(np.stack([gain, 1 - gain], axis=1))
    assert found.value == pytest.approx(0.5)
    error = gain.std() * math.sqrt(2 / 40) / 2
    assert found.high - found.low == pytest.approx(2 * 1.96 * error, rel=0.06)


def test_random_signs_never_give_a_p_of_nothing():
    found = stats.paired(np.arange(1.0, 21.0), np.zeros(20), resamples=99)
    assert not found.exact
    assert found.p == 1 / 100


def test_the_tasks_of_one_seed_are_averaged_and_flip_together():
    x, y = rng.normal(size=(6, 3)), rng.normal(size=(6, 3))
    found, averaged = stats.paired(x, y), stats.paired(x.mean(axis=1), y.mean(axis=1))
    assert found.difference.value == pytest.approx((x - y).mean())
    assert found.p == averaged.p
    assert found.pairs == 6


def test_half_of_any_even_number_of_runs_is_there_at_the_median():
    for n in range(2, 80, 2):
        assert stats.kaplan_meier(np.arange(1, n + 1), np.ones(n)).median == n / 2


@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.99])
def test_intervals_are_as_wide_as_their_confidence_asks_for(confidence):
    times = np.random.default_rng(0).uniform(1, 3, size=60)
    mean = stats.restricted_mean(stats.kaplan_meier(times, np.ones(60), confidence), 2.5)
    reach = scipy.stats.norm.ppf((1 + confidence) / 2)
    assert mean.high - mean.value == pytest.approx(reach * mean.standard_error)
    assert mean.confidence == confidence
    x, y = np.arange(60.0), np.arange(60.0) + 20.3
    wins = stats.probability_of_improvement(x, y, confidence, seed=1)
    often = np.random.default_rng(2).integers(60, size=(2, 4000, 60))
    again = (x[often[0]][:, :, None] > y[often[1]][:, None, :]).mean(axis=(1, 2))
    tail = (1 - confidence) / 2
    np.testing.assert_allclose([wins.low, wins.high], np.quantile(again, [tail, 1 - tail]),
                               atol=0.02)  # fmt: skip
    profile = stats.performance_profile(x, [29.5], confidence)
    normal = scipy.stats.binom.ppf([tail, 1 - tail], 60, 0.5) / 60
    np.testing.assert_allclose([profile.low[0], profile.high[0]], normal, atol=0.02)


def test_two_seeds_say_something():
    assert stats.interval([1.0, 2.0]).known
    assert not stats.interval([1.0]).known


def test_the_median_of_an_even_number_of_scores_is_halfway_between_the_two_in_the_middle():
    assert stats.interval([10.0, 1.0, 2.0, 3.0], "median").value == 2.5
    assert stats.interval([[10.0, 1.0], [2.0, 3.0]], "median").value == 2.5


def test_the_optimality_gap_is_measured_from_the_score_that_is_wanted():
    assert stats.optimality_gap([1.0, 5.0, 3.5], wanted=4.0) == pytest.approx((3 + 0 + 0.5) / 3)


def test_two_evaluations_at_one_time_are_refused():
    with pytest.raises(SettingsError, match="increasing"):
        stats.time_to_threshold([0, 10, 10], [1, 2, 3], 2)
