"""Figures of results: bands are the stats intervals; seeds and cost stand in the figure."""

import subprocess
import sys

import numpy as np
import pytest
from matplotlib.collections import FillBetweenPolyCollection
from matplotlib.colors import to_hex
from matplotlib.text import Text
from PIL import Image

from revolver_lab import lab, stats
from revolver_lab.errors import SettingsError
from revolver_lab.lab import plot_parts, plots

COST = stats.Cost(steps=1_400_000, seconds=190, evaluation_steps=200_000, expert_steps=100_000)
STEPS = np.arange(6) * 1000
ALPHAS = np.linspace(0, 1, 5)
THRESHOLDS = np.linspace(0, 1, 7)
rng = np.random.default_rng(0)
TEN, THREE = rng.normal(50, 9, size=(10, 6)), rng.normal(20, 4, size=(3, 6))
EPISODES = rng.normal(1000, 100, size=(5, 12))
SEEDS = rng.normal(2000, 100, size=(4, 5, 12))
TIMES = stats.Times(np.array([1.0, 2, 2, 5, 5]), np.array([True, True, True, False, False]))

DRAWN = {
    "curves": lambda: plots.curves({"Ours": TEN, "Theirs": THREE}, STEPS, cost=COST),
    "rows": lambda: plots.rows({"Ours": TEN[:, 0], "Theirs": THREE}, cost=COST),
    "along_alpha": lambda: plots.along_alpha({"Ours": SEEDS}, ALPHAS, cost=COST),
    "survival": lambda: plots.survival({"Ours": TIMES}, cost=COST),
    "profile": lambda: plots.profile({"Ours": TEN / 100}, THRESHOLDS, cost=COST),
}
COUNTS = {
    "curves": ["Ours (10 seeds)", "Theirs (3 seeds)"],
    "rows": ["Ours\n10 seeds", "Theirs\n3 seeds"],
    "along_alpha": ["Ours (4 seeds)"],
    "survival": ["Ours\n(3 of 5 seeds)"],
    "profile": ["Ours (10 seeds)"],
}


def _texts(drawing):
    return [each.get_text() for each in drawing.figure.findobj(Text)]


def _bands(drawing):
    """(lowest, highest) of each filled band at each x."""
    found = []
    for each in drawing.figure.axes[0].findobj(FillBetweenPolyCollection):
        points = each.get_paths()[0].vertices
        at = np.unique(points[:, 0])
        column = [points[points[:, 0] == x, 1] for x in at]
        found.append(np.array([[c.min(), c.max()] for c in column]))
    return found


@pytest.mark.parametrize("name", DRAWN)
def test_seeds_interval_and_cost_stand_in_the_figure(name):
    drawing = DRAWN[name]()
    texts = _texts(drawing)
    whole = " ".join(texts).replace("\n", " ")
    assert set(COUNTS[name]) <= set(texts)
    assert "95 %" in whole
    assert "interval over seeds" in whole
    assert f"Cost: {COST}." in whole
    assert "(1.7 M in all); 3 min" in whole
    assert plot_parts.ONE_SEED not in whole


@pytest.mark.parametrize("name", DRAWN)
def test_every_figure_is_a_drawing_with_words_and_a_file(name, tmp_path):
    drawing = DRAWN[name]()
    assert isinstance(drawing, lab.Drawing)
    assert f"Cost: {COST}." in drawing.alt
    assert "seeds" in drawing.alt
    assert "95 % interval" in drawing.alt
    with Image.open(drawing.save(tmp_path / "figure.png")) as saved:
        assert 800 <= saved.width <= 1000


def test_the_bands_of_curves_are_the_intervals_of_stats():
    bands = _bands(DRAWN["curves"]())
    for drawn, curves in zip(bands, (TEN, THREE), strict=True):
        found = [stats.interval(curves[:, k]) for k in range(6)]
        assert np.allclose(drawn, [[each.low, each.high] for each in found])


def test_the_words_of_curves_are_the_intervals_at_the_end():
    last = stats.interval(TEN[:, -1])
    told = f"Ours ends at {last.value:.3g} (95 % interval {last.low:.3g} to {last.high:.3g}"
    assert told in DRAWN["curves"]().alt


def test_a_row_has_its_interval_and_every_seed():
    drawing = DRAWN["rows"]()
    lines = drawing.figure.axes[0].lines
    # three for each method: seeds, interval, value; episodes of a seed are averaged first
    for k, scores in enumerate((TEN[:, 0], THREE.mean(axis=1))):
        dots, bar, value = lines[3 * k : 3 * k + 3]
        found = stats.interval(scores)
        assert np.allclose(dots.get_xdata(), scores)
        assert np.allclose(bar.get_xdata(), [found.low, found.high])
        assert np.allclose(value.get_xdata(), found.value)
        assert f"{found.value:.3g} (95 % interval {found.low:.3g} to" in drawing.alt


def test_rows_can_show_the_iqm():
    drawing = plots.rows({"Ours": TEN[:, 0]}, cost=COST, statistic="iqm")
    assert np.allclose(drawing.figure.axes[0].lines[2].get_xdata(), stats.iqm(TEN[:, :1]))
    assert any("Dot: iqm" in text for text in _texts(drawing))


def test_along_alpha_the_interval_is_over_seeds_where_there_are_some():
    found = stats.band(SEEDS.mean(axis=2))
    assert np.allclose(_bands(DRAWN["along_alpha"]())[0], np.stack([found.low, found.high], 1))


def test_along_alpha_episodes_of_one_policy_are_not_called_seeds():
    drawing = plots.along_alpha({"Expert": EPISODES}, ALPHAS, cost=COST)
    found = stats.band(EPISODES.T)
    whole = " ".join(_texts(drawing)).replace("\n", " ")
    assert np.allclose(_bands(drawing)[0], np.stack([found.low, found.high], 1))
    assert "Expert (12 episodes, 1 seed)" in whole
    assert "interval over episodes" in whole
    assert "of one policy, not of other seeds" in whole
    assert "12 episodes)" in drawing.alt


def test_the_cliff_is_told_in_words():
    cliff = np.array([[3000.0] * 2, [2900.0] * 2, [100.0] * 2, [-50.0] * 2, [20.0] * 2])
    alt = plots.along_alpha({"Expert": cliff}, ALPHAS, cost=COST).alt
    assert "3000 (95 % interval 3000 to 3000, 2 episodes) at alpha 0" in alt
    assert "lowest at alpha 0.75 with -50" in alt


def test_survival_draws_kaplan_meier_and_marks_the_censored():
    drawing = DRAWN["survival"]()
    steps, marks = drawing.figure.axes[0].lines
    curve = stats.kaplan_meier(*TIMES)
    assert steps.get_xdata().tolist() == [0, 1, 2, 5]
    assert np.allclose(steps.get_ydata(), [0, *(1 - curve.survival), 0.6])
    assert marks.get_xdata().tolist() == [5, 5]
    assert np.allclose(marks.get_ydata(), 0.6)
    low, high = 1 - curve.high, 1 - curve.low
    drawn = _bands(drawing)[0]
    assert drawn[0, 0] == pytest.approx(low[0])
    assert drawn[-1, 1] == pytest.approx(high[-1])
    assert "3 of 5 seeds got there, half of them by 2" in drawing.alt


def test_a_method_that_never_gets_there_is_drawn_flat():
    never = stats.Times(np.array([5.0, 5.0]), np.array([False, False]))
    drawing = plots.survival({"Ours": TIMES, "Never": never}, cost=COST)
    flat = drawing.figure.axes[0].lines[2]
    assert flat.get_xdata().tolist() == [0, 5]
    assert flat.get_ydata().tolist() == [0, 0]
    assert "Never: 0 of 2 seeds got there, fewer than half by 5" in drawing.alt


def test_the_bands_of_profiles_are_those_of_stats():
    found = stats.performance_profile(TEN / 100, THRESHOLDS)
    assert np.allclose(_bands(DRAWN["profile"]())[0], np.stack([found.low, found.high], 1))


def _alone(name):
    one = stats.Times(np.array([3.0]), np.array([True]))
    return {
        "curves": lambda: plots.curves({"Ours": TEN[0]}, STEPS, cost=COST),
        "rows": lambda: plots.rows({"Ours": [3.0]}, cost=COST),
        "along_alpha": lambda: plots.along_alpha({"Ours": SEEDS[:1]}, ALPHAS, cost=COST),
        "survival": lambda: plots.survival({"Ours": one}, cost=COST),
        "profile": lambda: plots.profile({"Ours": [0.3]}, THRESHOLDS, cost=COST),
    }[name]()


@pytest.mark.parametrize("name", DRAWN)
def test_one_seed_has_no_band_and_the_figure_says_so(name, tmp_path):
    drawing = _alone(name)
    whole = " ".join(_texts(drawing)).replace("\n", " ")
    assert not _bands(drawing)
    assert plot_parts.ONE_SEED in whole
    assert "1 seed" in whole
    assert "no interval" in drawing.alt
    assert drawing.save(tmp_path / "one.png").stat().st_size > 1000


def test_no_two_methods_look_alike():
    drawing = plots.curves({f"method {k}": THREE for k in range(20)}, STEPS, cost=COST)
    lines = drawing.figure.axes[0].lines
    assert len({(to_hex(line.get_color()), line.get_linestyle()) for line in lines}) == 20


def test_a_curve_first_measured_late_is_dotted_and_its_axis_begins_at_0():
    drawing = plots.curves({"Ours": TEN[:, :3]}, [24_000, 48_000, 72_000], cost=COST)
    axes = drawing.figure.axes[0]
    assert axes.get_xlim()[0] == 0
    assert axes.lines[0].get_marker() == "o"


def test_a_tie_does_not_look_like_a_spread_for_rows_begin_at_0():
    drawing = plots.rows({"Ours": [138.0, 140.0, 141.0]}, cost=COST)
    assert drawing.figure.axes[0].get_xlim()[0] == 0
    below = plots.rows({"Ours": [-3.0, 2.0]}, cost=COST)
    assert below.figure.axes[0].get_xlim()[0] < -3


def test_robots_beyond_source_and_target_are_refused():
    with pytest.raises(SettingsError, match="from 0 to 2"):
        plots.along_alpha({"Ours": EPISODES}, np.linspace(0, 2, 5), cost=COST)


def test_lines_that_coincide_are_told_apart_by_their_gaps():
    drawing = plots.curves({"one": THREE, "other": THREE}, STEPS, cost=COST)
    assert len({line.get_linestyle() for line in drawing.figure.axes[0].lines}) == 2


def test_nothing_is_left_in_pyplot():
    code = (
        "import sys; from revolver_lab import lab, stats; cost = stats.Cost(steps=1, seconds=1)\n"
        "lab.plots.rows({'a': [1.0, 2.0]}, cost=cost)\n"
        "print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: plots.curves({}, STEPS, cost=COST), "no method"),
        (lambda: plots.rows([1.0, 2.0], cost=COST), "name -> results"),
        (lambda: plots.rows({"": [1.0]}, cost=COST), "a method named ''"),
        (lambda: plots.rows({"Ours": [1.0]}, cost=None), "rvl.stats.Cost"),
        (lambda: plots.rows({"Ours": [np.nan]}, cost=COST), "scores of 'Ours'"),
        (lambda: plots.rows({"Ours": [1.0]}, cost=COST, statistic="best"), "'best'"),
        (lambda: plots.curves({"Ours": TEN}, STEPS[:3], cost=COST), "'Ours' of shape (10, 6)"),
        (lambda: plots.curves({"Ours": TEN}, -STEPS, cost=COST), "increasing"),
        (lambda: plots.along_alpha({"Ours": EPISODES}, ALPHAS[:2], cost=COST), "(2, episodes)"),
        (lambda: plots.along_alpha({"Ours": ALPHAS}, ALPHAS, cost=COST), "(5, episodes)"),
        (lambda: plots.survival({"Ours": [1.0, 2.0]}, cost=COST), "(times, observed)"),
        (lambda: plots.profile({"Ours": [0.1]}, [1, 0], cost=COST), "thresholds"),
    ],
)
def test_what_cannot_be_drawn_is_refused_by_name(call, text):
    with pytest.raises(SettingsError) as caught:
        call()
    assert text in str(caught.value)
