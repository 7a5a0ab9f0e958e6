"""Statistics of seeds, against published tables, SciPy, closed forms and brute force."""

import dataclasses
import math
import subprocess
import sys
from itertools import product

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

import revolver_lab as rvl
from revolver_lab import stats
from revolver_lab.errors import SettingsError

# Weeks of remission under 6-MP, Freireich et al. 1963 (Blood 21); 0 is censored.
WEEKS = [6, 6, 6, 6, 7, 9, 10, 10, 11, 13, 16, 17, 19, 20, 22, 23, 25, 32, 32, 34, 35]
RELAPSE = [0, 1, 1, 1, 1, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]
PLACEBO = [1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23]
rng = np.random.default_rng(0)
SCORES = rng.normal(size=(9, 4))
finite = st.floats(-100, 100)


def test_the_iqm_is_scipys_trimmed_mean_of_all_runs_and_tasks():
    for runs, tasks in product((1, 2, 3, 4, 5, 9, 10), (1, 3)):
        scores = rng.normal(size=(runs, tasks))
        assert stats.iqm(scores) == pytest.approx(scipy.stats.trim_mean(scores, 0.25, axis=None))


def test_a_list_of_runs_is_one_task():
    scores = [10.0, 0.0, 1.5, 0.5]
    for statistic in stats.STATISTICS.values():
        assert statistic(scores) == statistic(np.array(scores)[:, None])
    for wrong in ([], ["a"], [0.0, np.nan], None):
        with pytest.raises(SettingsError):
            stats.iqm(wrong)


@pytest.mark.parametrize(
    ("name", "value"),
    [("mean", 2.6), ("median", 1.0), ("iqm", (0.5 + 1 + 1.5) / 3), ("optimality gap", 0.3)],
)
def test_each_statistic_of_five_scores_is_the_one_worked_out_by_hand(name, value):
    assert stats.interval([10.0, 0.0, 1.5, 0.5, 1.0], name).value == pytest.approx(value)


@pytest.mark.parametrize("name", stats.STATISTICS)
def test_the_bootstrap_is_that_over_all_possible_resamples(name):
    # 4^4 = 256 resamples of four runs can be listed; the levels are chosen between two atoms.
    scores = np.array([0.1, 0.7, 0.9, 2.3])
    every = np.array(list(product(range(4), repeat=4)))
    values = np.sort(stats.STATISTICS[name](scores[every][..., None]))
    found = stats.interval(scores, name, 0.8, resamples=200_000)
    for level, end in ((0.1, found.low), (0.9, found.high)):
        near = values[[int(256 * (level - 0.01)), int(256 * (level + 0.01)) + 1]]
        assert near[0] - 1e-12 <= end <= near[1] + 1e-12


def test_the_bootstrap_is_stratified_by_task():
    # Tasks of very different scale, no spread within: resampling within tasks changes nothing.
    scores = np.tile([0.0, 100.0], (6, 1))
    found = stats.interval(scores)
    assert (found.low, found.value, found.high) == (50, 50, 50)


def test_a_band_is_the_interval_at_each_point():
    curves = rng.normal(size=(7, 5))
    found = stats.band(curves, "iqm", 0.9, resamples=500, seed=3)
    for k in range(5):
        one = stats.interval(curves[:, k], "iqm", 0.9, resamples=500, seed=3)
        assert (one.value, one.low, one.high) == (found.value[k], found.low[k], found.high[k])


def test_a_profile_is_the_fraction_above_and_its_band_holds_it():
    thresholds = np.linspace(-3, 3, 13)
    found = stats.performance_profile(SCORES, thresholds)
    slow = [sum(score > tau for score in SCORES.ravel()) / SCORES.size for tau in thresholds]
    assert np.allclose(found.value, slow)
    assert (found.low <= found.value).all()
    assert (found.value <= found.high).all()
    spread = scipy.stats.norm.ppf(0.975) * np.sqrt(found.value * (1 - found.value) / SCORES.size)
    assert np.allclose(found.high - found.low, 2 * spread, atol=0.08)


def test_the_probability_of_improvement_is_mann_whitneys_u():
    x, y = rng.integers(0, 4, size=(8, 3)), rng.integers(0, 5, size=(6, 3))
    u = [scipy.stats.mannwhitneyu(x[:, t], y[:, t]).statistic / 48 for t in range(3)]
    found = stats.probability_of_improvement(x, y)
    assert found.value == pytest.approx(np.mean(u))
    assert found.low < found.value < found.high
    assert found.seeds == 6


@given(st.lists(finite, min_size=2, max_size=6), st.lists(finite, min_size=2, max_size=6))
def test_what_one_method_wins_the_other_loses(x, y):
    ours = stats.probability_of_improvement(x, y, resamples=10).value
    theirs = stats.probability_of_improvement(y, x, resamples=10).value
    assert ours + theirs == pytest.approx(1)


@given(st.lists(st.integers(-5, 5), min_size=1, max_size=8))
def test_the_sign_flip_p_counts_every_sign(difference):
    total = abs(sum(difference))
    signs = list(product((1, -1), repeat=len(difference)))
    far = [abs(np.dot(each, difference)) >= total for each in signs]
    found = stats.paired(difference, np.zeros(len(difference)), resamples=10)
    assert found.p == np.mean(far)
    assert found.exact
    assert found.pairs == len(difference)


def test_the_exact_p_is_scipys_permutation_test():
    x, y = rng.normal(size=10), rng.normal(size=10)
    theirs = scipy.stats.permutation_test(
        (x, y), lambda a, b: np.mean(a - b), permutation_type="samples", n_resamples=np.inf
    )
    assert stats.paired(x, y).p == pytest.approx(theirs.pvalue)


def test_sampled_signs_agree_with_all_signs():
    from revolver_lab.stats import comparing

    difference = rng.normal(0.4, 1, size=12)
    exact = comparing._all_signs(difference)
    sampled = comparing._some_signs(difference, 100_000, np.random.default_rng(1))
    assert abs(sampled - exact) < 5 * math.sqrt(exact * (1 - exact) / 100_000)
    assert not stats.paired(np.arange(13.0), np.zeros(13)).exact


def test_five_seeds_cannot_give_a_p_of_five_percent():
    found = stats.paired([9.0, 8.0, 7.0, 9.0, 8.0], [1.0, 0.0, 1.0, 2.0, 1.0])
    assert found.p == found.smallest_p == 0.0625


def test_pairs_are_found_by_their_seed_and_not_by_their_place():
    x, y = {0: 1.0, 1: 5.0, 2: 9.0}, {2: 8.0, 0: 0.0, 1: 4.0}
    found = stats.paired(x, y)
    assert (found.difference.low, found.difference.value, found.difference.high) == (1, 1, 1)


@pytest.mark.parametrize("n", [1, 2, 5, 10])
def test_the_success_interval_is_scipys_exact_one(n):
    for k in range(n + 1):
        found = stats.success(np.arange(n) < k, 0.9)
        theirs = scipy.stats.binomtest(k, n).proportion_ci(0.9, method="exact")
        assert (found.low, found.high) == pytest.approx((theirs.low, theirs.high))


@pytest.mark.parametrize("n", [1, 3, 5, 10])
def test_the_success_interval_covers_every_truth_as_often_as_it_says(n):
    found = [stats.success(np.arange(n) < k) for k in range(n + 1)]
    for p in np.linspace(0, 1, 201):
        covered = [each.low - 1e-9 <= p <= each.high + 1e-9 for each in found]
        assert scipy.stats.binom.pmf(np.arange(n + 1), n, p) @ covered >= 0.95


def _coverage(n: int, sets: int = 1500) -> float:
    draw = np.random.default_rng(n)
    found = [stats.interval(draw.normal(size=n), resamples=400, seed=draw) for _ in range(sets)]
    return float(np.mean([each.low <= 0 <= each.high for each in found]))


def test_the_interval_covers_the_mean_almost_as_often_as_it_says_and_less_with_few_seeds():
    # standard error of a coverage of 0.95 over 1500 sets: 0.006
    assert abs(_coverage(50) - 0.945) < 0.02
    assert abs(_coverage(5) - 0.84) < 0.03  # as the docstring of interval says


def test_the_restricted_mean_covers_the_truth_almost_as_often_as_it_says():
    draw, hits = np.random.default_rng(0), []
    for _ in range(3000):
        times, watched = draw.exponential(size=50), draw.uniform(1, 3, size=50)
        curve = stats.kaplan_meier(np.minimum(times, watched), times <= watched)
        found = stats.restricted_mean(curve, 1.0)
        hits.append(found.low <= 1 - math.exp(-1) <= found.high)
    assert abs(np.mean(hits) - 0.945) < 0.015


def test_the_survival_curve_is_the_published_one_of_the_leukaemia_trial():
    curve = stats.kaplan_meier(WEEKS, RELAPSE)
    assert curve.times.tolist() == [6, 7, 10, 13, 16, 22, 23]
    assert curve.survival.round(3).tolist() == [0.857, 0.807, 0.753, 0.690, 0.627, 0.538, 0.448]
    assert curve.at_risk.tolist() == [21, 17, 15, 12, 11, 7, 6]
    assert curve.median == 23
    # log-log limits as survival packages print them for this trial
    low = [0.6197, 0.5631, 0.5032, 0.4316, 0.3675, 0.2678, 0.1881]
    high = [0.9516, 0.9228, 0.8894, 0.8491, 0.8049, 0.7468, 0.6801]
    assert np.allclose(curve.low, low, atol=6e-5)
    assert np.allclose(curve.high, high, atol=6e-5)
    assert stats.kaplan_meier(PLACEBO, np.ones(21)).median == 8


def test_the_curve_and_its_interval_are_scipys():
    times = rng.integers(1, 12, size=40).astype(float)
    observed = rng.random(40) < 0.6
    censored = scipy.stats.CensoredData(uncensored=times[observed], right=times[~observed])
    theirs = scipy.stats.ecdf(censored).sf
    interval = theirs.confidence_interval(0.9, method="log-log")
    ours = stats.kaplan_meier(times, observed, 0.9)
    inside = ours.survival > 0
    assert np.allclose(ours.survival, theirs.evaluate(ours.times))
    assert np.allclose(ours.low[inside], interval.low.evaluate(ours.times[inside]))
    assert np.allclose(ours.high[inside], interval.high.evaluate(ours.times[inside]))


def test_where_nobody_is_left_the_interval_ends_where_it_ended_before():
    curve = stats.kaplan_meier([1, 2, 3], [1, 1, 1])
    assert curve.low[-1] == 0
    assert curve.high[-1] == curve.high[-2] < 1
    assert stats.kaplan_meier([5, 5], [1, 1]).high.tolist() == [1.0]


def test_a_run_that_never_gets_there_is_kept():
    dropped = stats.kaplan_meier([10, 20], [True, True])
    kept = stats.kaplan_meier([10, 20, 90, 90, 90], [True, True, False, False, False])
    assert dropped.median == 10
    assert kept.median == math.inf
    assert kept.left == pytest.approx(0.6)
    assert kept.censored.tolist() == [90, 90, 90]
    assert kept.seeds == 5


def test_the_curve_is_unknown_after_the_last_look_unless_all_are_there():
    curve = stats.kaplan_meier(WEEKS, RELAPSE)
    assert curve.at([0, 5.9, 35]).round(3).tolist() == [1, 1, 0.448]
    assert np.isnan(curve.at(36))
    assert stats.kaplan_meier([1, 2], [1, 1]).at(99) == 0


def test_the_restricted_mean_is_the_area_below_the_curve():
    curve = stats.kaplan_meier(WEEKS, RELAPSE)
    for until in (5.0, 6.0, 10.0, 20.5, 35.0):
        middle = (np.arange(200_000) + 0.5) * until / 200_000
        area = curve.at(middle).mean() * until
        assert stats.restricted_mean(curve, until).value == pytest.approx(area, abs=1e-3)


def test_the_restricted_mean_of_the_leukaemia_trial_is_that_of_survival_packages():
    found = stats.restricted_mean(stats.kaplan_meier(WEEKS, RELAPSE), 35)
    assert round(found.value, 2) == 23.29
    assert round(found.standard_error, 2) == 2.83


def test_without_censoring_it_is_the_mean_and_its_standard_error():
    times = np.array(PLACEBO, float)
    curve = stats.kaplan_meier(times, np.ones(21))
    for until in (8.0, 14.0, 23.0, 40.0):
        cut, found = np.minimum(times, until), stats.restricted_mean(curve, until)
        assert found.value == pytest.approx(cut.mean())
        assert found.standard_error == pytest.approx(cut.std() / math.sqrt(21))


def test_the_first_evaluation_at_the_threshold_counts_and_later_ones_do_not():
    steps, curves = [0, 10, 20, 30], [[0, 5, 1, 9], [5, 0, 0, 0], [4, 4, 4, 4]]
    times, observed = stats.time_to_threshold(steps, curves, 5)
    assert times.tolist() == [10, 0, 30]
    assert observed.tolist() == [True, True, False]
    assert stats.time_to_threshold(steps, curves[0], 6).times.tolist() == [30]


def test_one_seed_says_that_it_knows_nothing():
    one = stats.interval([3.0])
    assert (one.value, one.low, one.high, one.known) == (3, -math.inf, math.inf, False)
    assert stats.interval([[3.0, 4.0]]).high == math.inf  # tasks are no seeds
    band = stats.band([[1.0, 2.0]])
    assert np.isneginf(band.low).all()
    assert np.isposinf(band.high).all()
    wins = stats.probability_of_improvement([5.0], [1.0, 2.0])
    assert (wins.low, wins.value, wins.high) == (0, 1, 1)
    assert stats.performance_profile([1.0], [0.0]).low.tolist() == [0]
    assert stats.paired([5.0], [1.0]).p == 1
    mean = stats.restricted_mean(stats.kaplan_meier([4.0], [True]), 4.0)
    assert (mean.low, mean.value, mean.high) == (0, 4, 4)
    assert mean.standard_error == math.inf


def test_the_same_seed_gives_the_same_interval_and_a_generator_goes_on():
    assert stats.interval(SCORES, seed=4) == stats.interval(SCORES, seed=4)
    stream = np.random.default_rng(4)
    first, second = (stats.interval(SCORES, seed=stream) for _ in range(2))
    assert first == stats.interval(SCORES, seed=4) != second


GOOD = [1.0, 2.0, 3.0]
BAD_SCORES = [[], [[]], [1.0, math.nan], [math.inf], [[[1.0]]], "abc", 3.0, [[1.0], [1.0, 2.0]]]


@pytest.mark.parametrize("bad", BAD_SCORES)
def test_scores_that_are_none_are_refused_everywhere(bad):
    calls = [
        lambda: stats.interval(bad),
        lambda: stats.band(bad),
        lambda: stats.performance_profile(bad, [0.0]),
        lambda: stats.probability_of_improvement(bad, GOOD),
        lambda: stats.paired(bad, GOOD),
        lambda: stats.success(bad),
        lambda: stats.kaplan_meier(bad, GOOD),
        lambda: stats.time_to_threshold([0, 1], bad, 1.0),
    ]
    for call in calls:
        with pytest.raises(SettingsError, match="Allowed"):
            call()


@pytest.mark.parametrize("confidence", [0, 1, -0.1, 95, math.nan, "0.95", None])
def test_a_confidence_outside_zero_to_one_is_refused(confidence):
    for call in (
        lambda: stats.interval(GOOD, confidence=confidence),
        lambda: stats.band([GOOD], confidence=confidence),
        lambda: stats.performance_profile(GOOD, GOOD, confidence),
        lambda: stats.probability_of_improvement(GOOD, GOOD, confidence),
        lambda: stats.paired(GOOD, GOOD, confidence),
        lambda: stats.success([True], confidence),
        lambda: stats.kaplan_meier(GOOD, [1, 1, 1], confidence),
    ):
        with pytest.raises(SettingsError, match="confidence"):
            call()


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: stats.interval(GOOD, "mode"), "'iqm'"),
        (lambda: stats.interval(GOOD, resamples=0), "resamples = 0"),
        (lambda: stats.interval(GOOD, resamples=1.5), "resamples = 1.5"),
        (lambda: stats.interval(GOOD, seed=-1), "seed = -1"),
        (lambda: stats.interval(GOOD, seed="a"), "seed = 'a'"),
        (lambda: stats.performance_profile(GOOD, [[0.0]]), "thresholds"),
        (lambda: stats.probability_of_improvement(SCORES, GOOD), "4 tasks and y with 1"),
        (lambda: stats.paired(GOOD, GOOD[:2]), "the same seeds"),
        (lambda: stats.paired({0: 1.0, 1: 2.0}, {0: 1.0, 2: 2.0}), "seeds [0, 1] and [0, 2]"),
        (lambda: stats.paired({0: 1.0}, [1.0]), "one method only"),
        (lambda: stats.success([0.5, 1.0]), "true and false"),
        (lambda: stats.success([[True]]), "(runs,)"),
        (lambda: stats.kaplan_meier(GOOD, [1, 0]), "(3,) and observed of shape (2,)"),
        (lambda: stats.kaplan_meier([-1.0], [1]), "times from -1"),
        (lambda: stats.kaplan_meier([1.0], [2]), "observed up to 2"),
        (lambda: stats.restricted_mean(stats.kaplan_meier([3], [0]), 4), "(0, 3]"),
        (lambda: stats.restricted_mean(stats.kaplan_meier([3], [0]), 0), "until = 0"),
        (lambda: stats.time_to_threshold([1, 0], [1, 2], 1), "increasing"),
        (lambda: stats.time_to_threshold([0, 1, 2], [[1, 2]], 1), "(S, 3)"),
        (lambda: stats.time_to_threshold([0, 1], [1, 2], math.nan), "threshold"),
        (lambda: stats.Cost(steps=-1, seconds=0), "steps = -1"),
        (lambda: stats.Cost(steps=1, seconds=math.nan), "seconds = nan"),
        (lambda: stats.Cost(steps="1", seconds=1), "steps = '1'"),
    ],
)
def test_what_cannot_work_is_refused_by_name(call, text):
    with pytest.raises(SettingsError) as caught:
        call()
    assert text in str(caught.value)


def test_costs_add_up_and_are_told_whole():
    one = stats.Cost(steps=700_000, seconds=90, evaluation_steps=100_000)
    both = one + dataclasses.replace(one, expert_steps=100_000)
    assert both.all_steps == 1_700_000
    assert str(both) == (
        "1.4 M steps of training, 200 k of evaluation, 100 k for the expert (1.7 M in all); 3 min"
    )


@pytest.mark.parametrize(
    ("steps", "seconds", "text"),
    [
        (0, 0, "0 steps of training; 0 s"),
        (999, 59.4, "999 steps of training; 59 s"),
        (1000, 60, "1 k steps of training; 1 min"),
        (999_600, 3569, "1 M steps of training; 59 min"),
        (12_345_678, 5400, "12.3 M steps of training; 1.5 h"),
        (5e12, 3571, "5000 G steps of training; 1.0 h"),
    ],
)
def test_a_cost_reads_well_at_every_size(steps, seconds, text):
    assert str(stats.Cost(steps=steps, seconds=seconds)) == text


def test_stats_is_public_and_light():
    code = (
        "import sys, revolver_lab as rvl; rvl.stats.interval([1.0, 2.0])\n"
        "print(sorted({'torch', 'matplotlib', 'mujoco', 'scipy.stats'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert rvl.stats is stats
