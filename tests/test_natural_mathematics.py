"""The mathematics of NPG against linear algebra, torch's autograd, brute force and scipy."""

import itertools

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

from revolver_lab.cards import ModelCard
from revolver_lab.learners.natural import gaussian, networks
from revolver_lab.learners.natural.actor import Actor, Rows
from revolver_lab.learners.natural.advantages import gae, whitened
from revolver_lab.learners.natural.regressor import Regressor
from revolver_lab.learners.natural.steps import conjugate_gradient, natural_step

SIZES = (5, 7, 6, 3)


def some_actor(activation="tanh", affine=True, dtype=np.float64):
    rng = np.random.default_rng(3)
    flat = networks.initial(SIZES, rng).astype(np.float64)
    flat += 0.1 * rng.standard_normal(flat.shape)
    scales = {
        "input_shift": rng.standard_normal(5), "input_scale": rng.uniform(0.5, 2, 5),
        "output_shift": rng.standard_normal(3), "output_scale": rng.uniform(0.5, 2, 3),
    }  # fmt: skip
    flat = np.concatenate([flat, [-0.5, 0.0, 0.4]]).astype(dtype)
    return Actor(SIZES, flat, activation, scales if affine else None)


def torch_mean(actor, flat, observations):
    """The same policy written a second time, in torch."""
    x = torch.as_tensor(observations)
    if "input_shift" in actor.affine:
        x = (x - torch.as_tensor(actor.affine["input_shift"])) / torch.as_tensor(
            actor.affine["input_scale"]
        )
    at = 0
    for i, (width, out) in enumerate(itertools.pairwise(SIZES)):
        weight = flat[at : at + width * out].reshape(out, width)
        at += width * out
        x = x @ weight.T + flat[at : at + out]
        at += out
        if i < len(SIZES) - 2:
            x = torch.tanh(x) if actor.activation == "tanh" else torch.relu(x)
    if "output_shift" in actor.affine:
        x = x * torch.as_tensor(actor.affine["output_scale"])
        x = x + torch.as_tensor(actor.affine["output_shift"])
    return x, flat[at:]


def torch_kl(actor, flat, observations):
    """Mean KL from the actor as it is to the one of other parameters, by torch.distributions."""
    normal = torch.distributions.Normal
    mean, log_std = torch_mean(actor, torch.as_tensor(actor.flat), observations)
    other_mean, other_log_std = torch_mean(actor, flat, observations)
    p, q = normal(mean, log_std.exp()), normal(other_mean, other_log_std.exp())
    return torch.distributions.kl_divergence(p, q).sum(dim=-1).mean()


def kl_gradient(actor, flat, observations):
    flat = torch.tensor(flat, requires_grad=True)
    return torch.autograd.grad(torch_kl(actor, flat, observations), flat)[0].numpy()


OBSERVATIONS = np.random.default_rng(0).standard_normal((101, 5))  # no multiple of any block


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 12), st.integers(0, 10_000))
def test_conjugate_gradients_solve_what_numpy_solves(size, seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((size, size))
    matrix, b = root @ root.T + np.eye(size), rng.standard_normal(size)
    found = conjugate_gradient(lambda x: matrix @ x, b, 3 * size, tolerance=1e-24)
    assert np.allclose(found, np.linalg.solve(matrix, b), rtol=1e-6, atol=1e-8)


def test_few_iterations_get_nearer_with_each():
    rng = np.random.default_rng(1)
    root = rng.standard_normal((30, 30))
    matrix, b = root @ root.T + np.eye(30), rng.standard_normal(30)
    exact = np.linalg.solve(matrix, b)

    def missed(iterations):
        apart = conjugate_gradient(lambda x: matrix @ x, b, iterations) - exact
        return apart @ matrix @ apart

    errors = [missed(k) for k in range(12)]
    assert all(later < earlier for earlier, later in itertools.pairwise(errors))


def test_nothing_is_solved_for_a_zero_and_no_step_goes_where_nothing_rises():
    assert not conjugate_gradient(lambda x: x, np.zeros(3), 5).any()
    for slope in (np.zeros(3), -np.ones(3), np.full(3, np.nan)):
        assert not natural_step(np.ones(3), slope, 0.1).any()


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("affine", [True, False])
def test_the_fisher_product_is_a_finite_difference_of_the_kls_gradient(activation, affine):
    actor = some_actor(activation, affine)
    product = actor.fisher(OBSERVATIONS, damping=0.0)
    rng, step = np.random.default_rng(5), 1e-6
    for _ in range(5):
        v = rng.standard_normal(actor.flat.shape)
        ahead = kl_gradient(actor, actor.flat + step * v, OBSERVATIONS)
        behind = kl_gradient(actor, actor.flat - step * v, OBSERVATIONS)
        assert np.allclose(product(v), (ahead - behind) / (2 * step), rtol=1e-5, atol=1e-6)


def test_damping_adds_to_the_diagonal():
    actor = some_actor()
    v = np.random.default_rng(2).standard_normal(actor.flat.shape)
    plain, damped = (actor.fisher(OBSERVATIONS, damping=d)(v) for d in (0.0, 0.3))
    assert np.allclose(damped - plain, 0.3 * v)


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("affine", [True, False])
def test_the_gradient_is_the_one_of_autograd(activation, affine):
    actor, rng = some_actor(activation, affine), np.random.default_rng(1)
    actions, weights = rng.standard_normal((101, 3)), rng.standard_normal(101)
    rows = Rows(observations=OBSERVATIONS, actions=actions, weights=weights)
    flat = torch.tensor(actor.flat, requires_grad=True)
    mean, log_std = torch_mean(actor, flat, OBSERVATIONS)
    density = torch.distributions.Normal(mean, log_std.exp()).log_prob(torch.as_tensor(actions))
    value = (torch.as_tensor(weights) * density.sum(dim=-1)).sum()
    assert np.allclose(actor.gradient(rows), torch.autograd.grad(value, flat)[0].numpy())


@pytest.mark.parametrize("step_size", [1e-5, 1e-4, 1e-3])
def test_a_small_normalised_step_has_the_kl_that_was_asked_for(step_size):
    actor, rng = some_actor(), np.random.default_rng(7)
    rows = Rows(observations=OBSERVATIONS, actions=rng.standard_normal((101, 3)),
                weights=rng.standard_normal(101))  # fmt: skip
    gradient = actor.gradient(rows)
    direction = conjugate_gradient(actor.fisher(OBSERVATIONS, 1e-4), gradient, 10)
    step = natural_step(gradient, direction, step_size)
    measured = float(torch_kl(actor, torch.as_tensor(actor.flat + step), OBSERVATIONS))
    assert measured == pytest.approx(step_size / 2, rel=0.02 + np.sqrt(step_size))
    # And no other direction rises as much, to first order, for the same KL.
    fisher = actor.fisher(OBSERVATIONS, 1e-4)
    for _ in range(20):
        other = rng.standard_normal(step.shape)
        other *= np.sqrt((step @ fisher(step)) / (other @ fisher(other)))
        assert gradient @ other < gradient @ step


def test_the_density_is_scipys():
    rng = np.random.default_rng(0)
    mean, log_std, actions = rng.standard_normal((3, 50, 4))
    log_std = log_std[0]
    expected = stats.norm.logpdf(actions, mean, np.exp(log_std)).sum(axis=-1)
    assert np.allclose(gaussian.log_density(actions, mean, log_std), expected)


def test_the_score_is_a_finite_difference_of_the_density():
    rng, step = np.random.default_rng(0), 1e-6
    mean, log_std, action = rng.standard_normal((3, 4))
    by_mean, by_spread = gaussian.score(action, mean, log_std)
    for i, e in enumerate(step * np.eye(4)):
        f = gaussian.log_density
        ahead, behind = f(action, mean + e, log_std), f(action, mean - e, log_std)
        assert by_mean[i] == pytest.approx((ahead - behind) / (2 * step), rel=1e-5, abs=1e-6)
        ahead, behind = f(action, mean, log_std + e), f(action, mean, log_std - e)
        assert by_spread[i] == pytest.approx((ahead - behind) / (2 * step), rel=1e-5, abs=1e-6)


def test_the_kl_is_the_integral_that_defines_it():
    mean, log_std, other, other_log_std = 0.3, -0.4, -0.8, 0.2
    p, q = stats.norm(mean, np.exp(log_std)), stats.norm(other, np.exp(other_log_std))
    expected, _ = integrate.quad(lambda x: p.pdf(x) * (p.logpdf(x) - q.logpdf(x)), -8, 8)
    found = gaussian.kl(*(np.array([v]) for v in (mean, log_std, other, other_log_std)))
    assert found == pytest.approx(expected, rel=1e-6)


def brute_force(rewards, values, length, terminated, gamma, decay, bootstrap):
    """A_t as a sum over all n-step advantages, each weighted by (1 - lambda) lambda^(n - 1)."""
    tail = values[length] if bootstrap and not terminated else 0.0
    v, found = [*values[:length], tail], np.zeros(len(rewards))
    for t in range(length):
        left = length - t
        steps = [sum(gamma**k * rewards[t + k] for k in range(n)) + gamma**n * v[t + n] - v[t]
                 for n in range(1, left + 1)]  # fmt: skip
        weights = [(1 - decay) * decay ** (n - 1) for n in range(1, left)] + [decay ** (left - 1)]
        found[t] = np.dot(weights, steps)
    return found


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.booleans(), st.sampled_from([0.0, 0.5, 0.97, 1.0]))
def test_gae_is_the_weighted_sum_of_all_n_step_advantages(seed, bootstrap, decay):
    rng = np.random.default_rng(seed)
    rewards, values = rng.standard_normal((6, 4)), rng.standard_normal((7, 4))
    lengths, terminated = rng.integers(1, 7, 4), rng.random(4) < 0.5
    found = gae(rewards, values, lengths, terminated, gamma=0.9, decay=decay, bootstrap=bootstrap)
    for i in range(4):
        expected = brute_force(rewards[:, i], values[:, i], lengths[i], terminated[i], 0.9, decay,
                               bootstrap)  # fmt: skip
        assert np.allclose(found[:, i], expected)


def test_whitening_leaves_mean_zero_and_variance_one_or_nothing():
    found = whitened(np.array([3.0, 5.0, 10.0]))
    assert found.mean() == pytest.approx(0)
    assert found.std() == pytest.approx(1)
    assert not whitened(np.full(5, 7.0)).any()


def test_an_actor_acts_as_the_policy_it_was_taken_from_and_gives_it_back():
    rng = np.random.default_rng(0)
    policy = some_actor(dtype=np.float32).policy(ModelCard(), {})
    actor, seen = Actor.of(policy, 0.0), rng.standard_normal((9, 5)).astype(np.float32)
    assert np.allclose(np.clip(actor.mean(seen), -1, 1), policy(seen), atol=1e-6)
    assert np.allclose(actor.means(seen), actor.mean(seen), atol=1e-6)
    again = actor.policy(policy.card, {})
    assert all(np.array_equal(again.weights[k], v) for k, v in policy.weights.items())


def regressor(**changes):
    arguments = {"hidden": (16,), "learning_rate": 1e-2, "batch_size": 32} | changes
    return Regressor(2, 1, rng=np.random.default_rng(0), **arguments)


def test_a_regressor_learns_a_function_and_starts_at_zero():
    x = np.random.default_rng(1).uniform(-2, 2, (500, 2))
    y = 50 + 20 * np.sin(x[:, :1]) * x[:, 1:]
    net = regressor()
    assert not net.predict(x).any()
    net.fit(x, y, 60)
    assert np.var(net.predict(x) - y) < 0.02 * np.var(y)


def test_new_targets_rescale_a_regressor_without_moving_its_predictions():
    x = np.random.default_rng(1).uniform(-2, 2, (300, 2))
    net = regressor()
    net.fit(x, x[:, :1], 5)
    before = net.predict(x)
    net._rescale(1000 + 300 * x[:, 1:])
    assert np.allclose(net.predict(x), before, atol=1e-3)
    assert net.target_scale > 100


def test_the_regressors_update_is_torchs_adam():
    rng = np.random.default_rng(4)
    x, y = rng.standard_normal((50, 2)), rng.standard_normal((50, 1))
    net = regressor(batch_size=64)
    flat = torch.tensor(net.flat, requires_grad=True)
    adam = torch.optim.Adam([flat], lr=1e-2)
    net.fit(x, y, 4)
    seen = torch.as_tensor(((x - x.mean(0)) / x.std(0)).astype(np.float32))
    aim = torch.as_tensor(((y - y.mean(0)) / y.std(0)).astype(np.float32))
    for _ in range(4):
        out = torch.tanh(seen @ flat[:32].reshape(16, 2).T + flat[32:48])
        loss = 0.5 * ((out @ flat[48:64] + flat[64] - aim[:, 0]) ** 2).mean()
        adam.zero_grad()
        loss.backward()
        adam.step()
    assert np.allclose(net.flat, flat.detach().numpy(), atol=2e-5)
