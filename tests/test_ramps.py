"""f is a continuous path from 0 to 1, and anything else is refused with its reason."""

import math
import re

import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.errors import ParameterError
from revolver_lab.evolution.ramps import NAMED, Ramps, checked, ramp


@pytest.mark.parametrize("name", sorted(NAMED))
def test_every_named_f_is_a_monotone_path_from_0_to_1(name):
    values = np.array([checked(name)(a) for a in np.linspace(0, 1, 101)])
    assert values[0] == 0.0
    assert values[-1] == 1.0
    assert (np.diff(values) > 0).all()


def test_a_ramp_rests_outside_its_part_of_the_path():
    late = ramp(0.5, 0.75)
    assert [late(a) for a in (0.0, 0.5, 0.625, 0.75, 1.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]


@pytest.mark.parametrize(
    ("f", "words"),
    [
        ("cubic", "'linear', 'smoothstep'"),
        (lambda a: a + 0.1, "f(0) = 0.1"),
        (lambda a: 0.5 * a, "f(1) = 0.5"),
        (lambda a: float(a >= 0.5), "jump"),
        (lambda a: a + math.sin(math.pi * a), "[0, 1]"),
        (lambda a: a if a in (0, 1) else math.nan, "not finite"),
        (lambda a: a[0], "raised"),
        (3.0, "callable"),
    ],
)
def test_what_is_no_path_is_refused_with_the_reason(f, words):
    with pytest.raises(ParameterError, match=re.escape(words)):
        checked(f)


def test_a_ramp_outside_the_path_is_refused():
    with pytest.raises(ParameterError, match="start < stop"):
        ramp(0.5, 0.5)


def test_the_first_matching_pattern_moves_a_parameter_and_the_rest_is_linear():
    ramps = Ramps({"geom/a/*": ramp(0.5, 1.0), "geom/*": "smoothstep"})
    groups = ramps.groups(["geom/a/size", "geom/b/size", "joint/c/range"])
    assert ramps(0.25)[groups].tolist() == [0.0, 0.15625, 0.25]


def test_a_pattern_that_matches_nothing_is_refused():
    with pytest.raises(ParameterError, match="matches no parameter"):
        Ramps({"geom/typo/*": "linear"}).groups(["geom/a/size"])


@pytest.mark.parametrize("name", ["geom/a [b]/size[0] [m]", "geom/a [b]/size[0]", "geom/*/size*"])
def test_a_name_of_theta_is_its_own_pattern_with_its_unit_or_without(name):
    names = ["geom/a [b]/size[0] [m]", "geom/a [b]/margin"]
    ramps = Ramps({name: "smoothstep"})
    assert ramps(0.25)[ramps.groups(names)].tolist() == [0.15625, 0.25]


def test_every_name_that_an_evolution_prints_is_taken_for_f():
    body = "<body name='b [1]'><joint name='j'/><geom size='{}'/></body>"
    robot = f"<mujoco><worldbody>{body}</worldbody></mujoco>"
    ends = [robot.format(radius) for radius in (0.1, 0.2)]
    names = rvl.Evolution(*ends).theta_names
    assert any(name.endswith(" [m]") for name in names)
    early = rvl.Evolution(*ends, f={name: ramp(0.0, 0.5) for name in names})
    np.testing.assert_array_equal(early.theta(0.5), early.theta(1.0))


@pytest.mark.parametrize("height", [0.3, 0.6])
@pytest.mark.parametrize("where", [0.001, 0.5, 0.9])
def test_a_jump_of_part_of_the_way_is_refused_wherever_it_is(height, where):
    with pytest.raises(ParameterError, match="jump"):
        checked(lambda a: (1 - height) * a + height * (a >= where))


def test_a_path_that_does_not_begin_at_the_source_is_refused_although_it_ends_at_the_target():
    with pytest.raises(ParameterError, match=r"f\(0\) = 0.1, f\(1\) = 1"):
        checked(lambda a: 0.1 + 0.9 * a)


def test_a_steep_slope_is_no_jump():
    steep = checked(lambda a: float(np.clip((a - 0.5) / 0.002, 0, 1)))
    assert steep(0.501) == pytest.approx(0.5)


def test_what_rounding_lets_out_of_0_to_1_is_brought_back():
    ramps = Ramps(lambda a: a + 8e-10 * (2 * a - 1))
    assert (ramps(1e-12)[0], ramps(1 - 1e-12)[0]) == (0.0, 1.0)
    assert ramps(0.0)[0] == 0.0
    assert ramps(1.0)[0] == 1.0
