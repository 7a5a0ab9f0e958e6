"""Shaping: three forms of one preference, of which the normalised leaves the mean reward alone."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from revolver_lab.errors import UnknownNameError
from revolver_lab.shaping import FORMS, weight

phases = st.tuples(st.floats(0, 1), st.floats(0, 1), st.floats(-20, 20))
"""alpha, xi and h."""


@pytest.mark.parametrize("form", FORMS)
@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_without_h_every_weight_is_exactly_one(form, beta, alpha, xi):
    assert weight(beta, alpha, xi, 0.0, form) == 1.0


def test_the_papers_form_is_exp_of_h_beta_whatever_the_phase():
    betas = np.linspace(0, 1, 7)
    for alpha in (0.0, 0.4, 1.0):
        np.testing.assert_allclose(weight(betas, alpha, 0.1, 1.7, "absolute"), np.exp(1.7 * betas))


@given(phases)
def test_the_normalised_weight_has_the_mean_one_over_the_phase(phase):
    alpha, xi, h = phase
    end = min(alpha + xi, 1.0)
    if end - alpha < 1e-6:
        return
    mean = quad(lambda b: float(weight(b, alpha, xi, h, "normalised")), alpha, end)[0]
    assert abs(mean / (end - alpha) - 1) < 1e-7


@given(phases)
def test_within_a_phase_the_forms_are_multiples_of_each_other(phase):
    alpha, xi, h = phase
    betas = np.linspace(alpha, min(alpha + xi, 1.0), 5)
    rows = [weight(betas, alpha, xi, h, form) for form in FORMS]
    for row in rows[1:]:
        np.testing.assert_allclose(row / row[0], rows[0] / rows[0][0], rtol=1e-10)


@given(phases)
def test_the_relative_weight_of_the_least_evolved_robot_is_one(phase):
    alpha, xi, h = phase
    assert weight(alpha, alpha, xi, h, "relative") == 1.0


@pytest.mark.parametrize("form", ["relative", "normalised"])
@pytest.mark.parametrize(("alpha", "xi"), [(0.3, 0.0), (1.0, 0.0), (1.0, 0.2)])
def test_a_phase_of_one_robot_has_the_weight_one(form, alpha, xi):
    assert weight(alpha, alpha, xi, 3.0, form) == 1.0


@pytest.mark.parametrize("form", FORMS)
def test_more_evolved_robots_weigh_more_exactly_where_h_is_positive(form):
    betas = np.linspace(0.2, 0.4, 50)
    for h in (-3.0, -0.1, 0.1, 3.0):
        assert (np.sign(np.diff(weight(betas, 0.2, 0.2, h, form))) == np.sign(h)).all()


@pytest.mark.parametrize("tiny", [1e-3, 1e-6, 1e-9, 1e-12, 1e-300])
def test_a_small_h_loses_no_digits(tiny):
    # the series of y e^(y u) / (e^y - 1) to the second order, u = (beta - alpha) / xi in [0, 1]
    u, y = np.linspace(0, 1, 5), tiny * 0.2
    found = weight(0.3 + 0.2 * u, 0.3, 0.2, tiny, "normalised")
    series = 1 + y * (u - 0.5) + y**2 * (u**2 / 2 - u / 2 + 1 / 12)
    np.testing.assert_allclose(found, series, rtol=1e-12)


@pytest.mark.parametrize("h", [-5000.0, 5000.0])
def test_a_huge_h_stays_finite_when_normalised(h):
    found = weight(np.linspace(0, 1, 11), 0.0, 1.0, h, "normalised")
    assert np.isfinite(found).all()
    assert found.max() == pytest.approx(5000.0)


@pytest.mark.parametrize("form", FORMS)
def test_arrays_of_learners_agree_with_one_learner_at_a_time(form):
    rng = np.random.default_rng(0)
    beta = rng.uniform(size=(3, 8))
    alpha, xi, h = np.array([0.0, 0.5, 0.95]), np.array([0.0, 0.1, 0.2]), np.array([0.0, 1.0, 8.0])
    together = weight(beta, alpha[:, None], xi[:, None], h[:, None], form)
    alone = [weight(beta[p], alpha[p], xi[p], h[p], form) for p in range(3)]
    np.testing.assert_array_equal(together, alone)


@pytest.mark.parametrize("form", FORMS)
def test_every_form_returns_the_shape_of_all_arguments_together(form):
    assert weight(0.3, np.zeros((4, 1)), np.zeros(3), 1.0, form).shape == (4, 3)
    assert weight(np.zeros(5), 0.0, 0.1, np.zeros((2, 1)), form).shape == (2, 5)


@pytest.mark.parametrize(
    ("form", "words"),
    [
        ("normalized", "Did you mean 'normalised'"),
        ("Relative", "'relative'"),
        ("x", "'absolute'"),
        (None, "shaping form None"),
    ],
)
def test_an_unknown_form_is_refused_with_the_near_one(form, words):
    with pytest.raises(UnknownNameError, match=re.escape(words)):
        weight(0.3, 0.2, 0.1, 1.0, form)
