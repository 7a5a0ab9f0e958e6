"""Exercises of notebook 07: right is praised, wrong is told why, and answers are the package's."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from revolver_lab.lifting import lift_weights
from revolver_lab.policies import Policy
from revolver_lab.robots import cheetah_segment as segment

NOTEBOOK = Path(__file__).parent.parent / "notebooks" / "07_limbs_that_grow.py"


def _zeros(weight, places, size):
    lifted = np.zeros((len(weight), size))
    lifted[:, places] = weight
    return lifted


def _ones(weight, places, size):
    lifted = np.ones((len(weight), size))
    lifted[:, places] = weight
    return lifted


def _rows(weight, places, size):
    lifted = np.zeros((size, weight.shape[1]))
    lifted[: len(weight)] = weight
    return lifted


def _ordered(weight, places, size):
    return _zeros(weight, np.sort(places), size)


def _padded(weight, places, size, front=0):
    new = size - weight.shape[1]
    return np.pad(weight, ((0, 0), (new, 0) if front else (0, new)))


def _packed(weight, places, size):
    """The package's own zero insertion, of a policy's first layer."""
    weights = {"actor.0.weight": weight, "actor.0.bias": np.zeros(len(weight))}
    rows = np.arange(len(weight))
    lifted = lift_weights(weights, 1, places, size, rows, len(weight))
    return lifted["actor.0.weight"]


def _searched(a, teacher, student, load):
    """The action whose movement is nearest, of very many."""
    actions = np.linspace(-1, 1, 2_000_001)
    return actions[np.argmin(np.abs(student * actions - load - teacher * a))]


def _turned(k):
    """How fast MuJoCo's segment turns under its own motor, its armature taken away."""
    accelerations = []
    for size in (k, 1.0):
        spec = segment.cheetah_with_segment(size)
        spec.joint("bsegment").armature = 0
        model = spec.compile()
        body = model.body("bsegment")
        distance = np.linalg.norm(body.ipos)
        inertia = body.mass[0] * distance**2 + np.sort(body.inertia)[-1]
        accelerations.append(model.actuator("bsegment").gear[0] / inertia)
    return accelerations[0] / accelerations[1]


RIGHT = {
    "one": [lambda k: k**-4, lambda k: k / (k**3 * k**2), _turned],
    "two": [_zeros, _packed, lambda w, p, n: w @ np.eye(n)[p]],
    "three": [lambda a, t, s, w: np.clip((t * a + w) / s, -1, 1),
              lambda a, t, s, w: max(-1, min(1, (t * a + w) / s)), _searched],
}  # fmt: skip

WRONG = {
    "one": [
        (lambda k: k**-5, "the torque shrinks too"),
        (lambda k: k**5, "torque over inertia"),
        (lambda k: k**4, "Upside down"),
        (lambda k: k**-2, "divided by the mass"),
        (lambda k: k**-3, "A power too few"),
        (lambda k: k**3, "how the mass shrinks"),
        (lambda k: k, "The torque shrinks so"),
        (lambda k: 1, "do not shrink alike"),
        (lambda k: 1 / k, "not with k\\^2"),
        (lambda k: 7, "For k = 0.5 you say 7"),
        (-4, "a function is asked for"),
    ],
    "two": [
        (_padded, "stand at the end"),
        (lambda w, p, n: _padded(w, p, n, front=1), "stand at the front"),
        (_ordered, "in another order"),
        (lambda w, p, n: np.zeros((len(w), n)), "old columns are missing"),
        (_ones, "listen to a limb"),
        (lambda w, p, n: _zeros(w, p, n) + 1e-3 * (np.isin(range(n), p) == 0), "listen to a limb"),
        (lambda w, p, n: 2 * _zeros(w, p, n), "not what and where they were"),
        (lambda w, p, n: _ones(2 * w, p, n), "Begin with a matrix of zeros"),
        (lambda w, p, n: w, "as many columns as before"),
        (lambda w, p, n: _zeros(w, p, n).T, "swapped"),
        (_rows, "You inserted rows"),
        (lambda w, p, n: w[:, p], "IndexError"),
        (lambda w, p, n: np.full((len(w), n), np.nan), "np.empty"),
        (lambda w, p, n: 0.0, "A matrix of shape"),
        (np.zeros((2, 5)), "a function is asked for"),
    ],
    "three": [
        (lambda a, t, s, w: a, "copies the teacher's action"),
        (lambda a, t, s, w: (t * a + w) / s, "but for the ends"),
        (lambda a, t, s, w: np.clip(t * a / s, -1, 1), "load is missing. The"),
        (lambda a, t, s, w: t * a / s, "and so are the ends"),
        (lambda a, t, s, w: np.clip((t * a - w) / s, -1, 1), "wrong sign"),
        (lambda a, t, s, w: np.clip(w / s, -1, 1), "did move, by g_teacher a"),
        (lambda a, t, s, w: np.clip(t * a + w, -1, 1), "Divide by how much"),
        (lambda a, t, s, w: np.clip(a + w / s, -1, 1), "action whole"),
        (lambda a, t, s, w: np.clip(t * a / s + w, -1, 1), "The load is a movement"),
        (lambda a, t, s, w: np.clip((s * a + w) / t, -1, 1), "swapped"),
        (lambda a, t, s, w: np.clip(s * a - w, -1, 1), "the other way round"),
        (lambda a, t, s, w: 0, "sinks by load"),
        (lambda a, t, s, w: 0.7, "Solve"),
        (0.31, "a function is asked for"),
    ],
}


def test_a_lifted_matrix_acts_as_before_whatever_the_new_limb_does():
    rng = np.random.default_rng(0)
    weight, places = rng.standard_normal((2, 3)), np.array([4, 0, 2])
    policy = Policy(weights={"actor.0.weight": weight, "actor.0.bias": np.zeros(2)}, head="tanh")
    grown = {"actor.0.weight": _zeros(weight, places, 5), "actor.0.bias": np.zeros(2)}
    seen = rng.standard_normal((20, 5))
    acted = Policy(weights=grown, head="tanh")(seen)
    np.testing.assert_allclose(acted, policy(seen[:, places]), atol=1e-12)


def test_the_armature_outweighs_a_limb_of_no_size_and_the_motor_fades_with_k():
    # What the praise of exercise 1 says of the cheetah, asked of MuJoCo itself.
    turned = []
    for k in (0.02, 1.0):
        model = segment.cheetah_with_segment(k).compile()
        data = mujoco.MjData(model)
        data.qpos[1] = 2.0  # in the air
        mujoco.mj_forward(model, data)
        before = data.qacc[-1]
        data.ctrl[-1] = 1.0
        mujoco.mj_forward(model, data)
        turned.append(float(data.qacc[model.joint("bsegment").dofadr[0]] - before))
    assert turned[0] == pytest.approx(0.02 * segment.GEAR / segment.ARMATURE, rel=0.01)
    assert turned[0] < turned[1]
    assert 5e6 < _turned(0.02) < 7e6
