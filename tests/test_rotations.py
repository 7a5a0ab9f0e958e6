"""Linear in theta is slerp in space."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from revolver_lab.evolution import rotations


def _scipy(quat):
    return Rotation.from_quat(quat, scalar_first=True)


@pytest.mark.parametrize("seed", range(20))
def test_a_fraction_of_the_rotation_vector_is_slerp(seed):
    a, b = Rotation.random(2, rng=np.random.default_rng(seed))
    source, target = a.as_quat(scalar_first=True), b.as_quat(scalar_first=True)
    vector = rotations.between_frames(source, target)
    for f in np.linspace(0, 1, 11):
        slerp = Slerp([0, 1], Rotation.concatenate([a, b]))(f)
        ours = _scipy(rotations.turned_frame(source, f * vector))
        assert (ours.inv() * slerp).magnitude() < 1e-9


@pytest.mark.parametrize("seed", range(20))
def test_an_axis_turns_at_constant_speed_along_the_shortest_arc(seed):
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(2, 3))
    vector = rotations.between_axes(source, target)
    angle = np.arccos(source @ target / np.linalg.norm(source) / np.linalg.norm(target))
    assert np.linalg.norm(vector) == pytest.approx(angle)
    third = rotations.turned_axis(source, vector / 3)
    assert np.arccos(third @ source / np.linalg.norm(source)) == pytest.approx(angle / 3)
    end = rotations.turned_axis(source, vector)
    np.testing.assert_allclose(end, target / np.linalg.norm(target), atol=1e-12)


def test_opposite_axes_still_have_a_way_from_one_to_the_other():
    axis = np.array([0.0, 1.0, 0.0])
    end = rotations.turned_axis(axis, rotations.between_axes(axis, -axis))
    np.testing.assert_allclose(end, -axis, atol=1e-12)


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("back", [False, True])
def test_axes_that_are_nearly_parallel_or_opposite_turn_by_what_is_between(angle, back):
    axis, target = np.array([0.0, 0.0, 1.0]), np.array([np.sin(angle), 0.0, np.cos(angle)])
    target = -target if back else target
    vector = rotations.between_axes(axis, target)
    expected = np.array([0.0, angle - np.pi if back else angle, 0.0])
    np.testing.assert_allclose(vector, expected, rtol=1e-6, atol=1e-15)
