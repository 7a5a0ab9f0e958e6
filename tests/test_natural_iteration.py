"""A whole iteration of NPG, DAPG and SOIL, written a second time."""

import dataclasses
import types

import numpy as np
import pytest
import torch
from test_natural_mathematics import OBSERVATIONS, brute_force, regressor, some_actor

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.learners.natural import networks
from revolver_lab.learners.natural.dapg import DAPG
from revolver_lab.learners.natural.npg import NPG
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.learners.natural.soil import SOIL
from revolver_lab.learners.natural.steps import conjugate_gradient
from revolver_lab.trajectories import Success, Trajectories

SMALL = NaturalSettings(
    trajectories=4, length=9, hidden=(6,), value_hidden=(8,), value_batch=16, warm_batches=0,
    gamma=0.9, gae=0.6, bootstrap=False, damping=0.3, cg_iterations=3, step_size=0.02,
    log_std_floor=-4.0,
)  # fmt: skip


def some_batch(seed=0, spread=1.0):
    """Four trajectories of one to nine steps that nobody played, as `sample` gives them."""
    rng = np.random.default_rng(seed)
    lengths, rewards = np.array([9, 4, 1, 7]), rng.standard_normal((9, 4))
    rewards[np.arange(9)[:, None] >= lengths] = 0.0
    return Trajectories(
        observations=rng.standard_normal((10, 4, 3)).astype(np.float32),
        actions=(spread * rng.standard_normal((9, 4, 2))).astype(np.float32),
        rewards=rewards, lengths=lengths, terminated=np.array([False, True, True, False]),
        betas=np.array([0.1, 0.5, 0.8, 1.0]), goal_steps=np.full(4, -1),
    )  # fmt: skip


def some_demonstrations(count=11):
    seen = np.random.default_rng(9).standard_normal((count, 3))
    return Demonstrations(lengths=[count], observations=seen, actions=0.3 * seen[:, :2],
                          next_observations=seen + 0.1, rewards=np.zeros(count))  # fmt: skip


def iterated(learner, batches, shaping=0.0):
    """Reports of iterations on batches that are given, in an environment that is not there."""
    given = iter(batches)
    learner.sample = lambda env: next(given)
    env = types.SimpleNamespace(draw_alpha=None)
    success = Success(least_return=0.0)
    return [learner.iterate(env, shaping=shaping, success=success) for _ in batches]


def slow_rewards(batch, shaping):
    """Every reward times exp(h beta) of its own robot."""
    shaped = [[r * np.exp(shaping * b) for r, b in zip(row, batch.betas)] for row in batch.rewards]
    return np.array(shaped)


def slow_advantages(batch, values, settings, shaping, decay):
    rewards = slow_rewards(batch, shaping)
    found = [
        brute_force(rewards[:, i], values[:, i], batch.lengths[i], batch.terminated[i],
                    settings.gamma, decay, settings.bootstrap)
        for i in range(len(batch.lengths))
    ]  # fmt: skip
    return np.array(found).T


def slow_step(learner, batch, advantages, weight, demonstrations):
    """The natural step with F written out and its inverse in a Krylov space, all by torch."""
    settings, actor = learner.settings, learner.actor
    flat = torch.tensor(actor.flat, dtype=torch.float64)
    (o, width, a), steps = actor.sizes, int(batch.lengths.sum())

    def mean(flat, seen):
        first, rest = flat[: o * width].reshape(width, o), flat[o * width :]
        hidden = torch.tanh(seen @ first.T + rest[:width])
        return hidden @ rest[width : width + width * a].reshape(a, width).T + flat[-2 * a : -a]

    def density(flat, seen, acted):
        normal = torch.distributions.Normal(mean(flat, seen), flat[-a:].exp())
        return normal.log_prob(acted).sum(dim=1)

    def objective(flat):
        found = (torch.as_tensor(advantages) * density(flat, seen, acted)).sum() / steps
        if demonstrations is not None:
            shown = (torch.as_tensor(x.astype(np.float64))
                     for x in (demonstrations.observations, demonstrations.actions))  # fmt: skip
            found = found + weight * density(flat, *shown).sum() / steps
        return found

    seen = torch.as_tensor(batch.observations[:-1][batch.inside].astype(np.float64))
    acted = torch.as_tensor(batch.actions[batch.inside].astype(np.float64))
    gradient = torch.autograd.functional.jacobian(objective, flat).numpy()
    jacobian = torch.autograd.functional.jacobian(lambda f: mean(f, seen), flat).numpy()
    scaled = jacobian / np.exp(actor.log_std)[:, None]
    fisher = np.einsum("nai,naj->ij", scaled, scaled) / steps
    fisher[-a:, -a:] += 2 * np.eye(a)
    fisher += settings.damping * np.eye(len(flat))
    # k conjugate gradients minimise x F x / 2 - g x over the span of g, F g, ..., F^(k-1) g
    powers = [gradient]
    for _ in range(settings.cg_iterations - 1):
        powers.append(fisher @ powers[-1])
    basis, _ = np.linalg.qr(np.array(powers).T)
    direction = basis @ np.linalg.solve(basis.T @ fisher @ basis, basis.T @ gradient)
    return np.sqrt(settings.step_size / (gradient @ direction)) * direction


@pytest.mark.parametrize("bootstrap", [True, False])
@pytest.mark.parametrize("kind", [NPG, DAPG])
def test_an_iteration_is_the_natural_step_written_out_a_second_time(kind, bootstrap):
    settings = dataclasses.replace(SMALL, bootstrap=bootstrap)
    shown = some_demonstrations() if kind is DAPG else None
    learner = kind(3, 2, settings, **({} if shown is None else {"demonstrations": shown}))
    learner.actor.log_std[:] = [-0.7, 0.3]
    learner.value.fit(some_batch(5), some_batch(5).rewards, np.zeros((10, 4)), 30)
    learner.iterations = 4
    batch, before = some_batch(), learner.actor.flat.copy()
    values = learner.value.predict(batch)
    assert np.abs(values).max() > 0.1
    found = slow_advantages(batch, values, settings, 1.5, settings.gae)[batch.inside]
    advantages = (found - found.mean()) / found.std()
    weight = settings.imitation_weight * settings.imitation_decay**4 * advantages.max()
    step = slow_step(learner, batch, advantages, weight, shown)
    [report] = iterated(learner, [batch], shaping=1.5)
    moved = learner.actor.flat - before
    assert np.abs(moved - step).max() < 1e-3 * np.abs(step).max()
    np.testing.assert_allclose(report.returns, batch.rewards.sum(axis=0))  # unshaped
    np.testing.assert_array_equal(report.successes, batch.rewards.sum(axis=0) >= 0)


@pytest.mark.parametrize("bootstrap", [True, False])
def test_the_value_net_is_fitted_to_discounted_shaped_returns_of_this_and_the_last_batch(bootstrap):
    settings = dataclasses.replace(SMALL, bootstrap=bootstrap, value_epochs=3)
    learner, batches = NPG(3, 2, settings), [some_batch(0), some_batch(1), some_batch(2)]
    steps, updates = int(batches[0].lengths.sum()), []
    for batch in batches:
        values = learner.value.predict(batch)
        [report] = iterated(learner, [batch], shaping=1.5)
        updates.append(learner.value.net.updates)
        returns = slow_advantages(batch, values, settings, 1.5, 1.0) + values[:-1]
        fitted = learner.value.state()[0]["last_y"][:, 0]
        np.testing.assert_allclose(fitted, returns[batch.inside], atol=1e-5)
        missed = (returns - values[:-1])[batch.inside]  # before the fit
        told = 1 - np.var(missed) / np.var(returns[batch.inside])
        assert report.explained == pytest.approx(told, abs=1e-5)
    passes = [3 * -(-count * steps // settings.value_batch) for count in (1, 2, 2)]
    assert np.diff([0, *updates]).tolist() == passes


def test_the_value_net_is_warmed_by_shaped_returns_as_often_as_was_asked():
    settings = dataclasses.replace(SMALL, warm_batches=2, warm_epochs=7)
    learner, batches = NPG(3, 2, settings), [some_batch(0), some_batch(1)]
    given = iter(batches)
    learner.sample = lambda env: next(given)
    assert learner._warm(types.SimpleNamespace(), 1.5) == 2 * 21
    zeros = np.zeros((10, 4))  # V before its first fit
    expected = slow_advantages(batches[1], zeros, settings, 1.5, 1.0)[batches[1].inside]
    np.testing.assert_allclose(learner.value.state()[0]["last_y"][:, 0], expected, atol=1e-5)
    assert learner.value.net.updates == 7 * -(-2 * 21 // settings.value_batch)


def test_the_value_net_normalises_what_is_seen_and_leaves_clock_and_robot_as_they_are():
    learner = NPG(3, 2, SMALL)
    iterated(learner, [some_batch()])
    arrays = learner.value.state()[0]
    seen = some_batch().observations[:-1][some_batch().inside]
    np.testing.assert_allclose(arrays["shift"][:3], seen.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(arrays["scale"][:3], seen.std(axis=0), rtol=1e-5)
    assert arrays["shift"][3:].tolist() == [0, 0, 0, 0]
    assert arrays["scale"][3:].tolist() == [1, 1, 1, 1]


def test_the_clock_runs_in_whole_trajectories_where_episodes_are_shorter():
    value = NPG(3, 2, dataclasses.replace(SMALL, length=18)).value
    seen = value.features(some_batch())
    np.testing.assert_allclose(seen[9, :, 3:6], np.tile([0.5, 0.25, 0.125], (4, 1)))
    np.testing.assert_allclose(seen[:, :, 6], np.tile(some_batch().betas, (10, 1)))


def test_an_input_that_hardly_moved_at_first_is_clipped_where_it_moves_later():
    x = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    x[:, 1] = 0.0  # its spread is then taken as 0.001
    net = regressor()
    net.fit(x, x[:, :1], 3)
    near, edge, far = (net.predict(np.array([[0.5, there]])) for there in (0.005, 0.01, 99.0))
    assert near != edge
    assert edge == far


def test_a_policy_from_scratch_begins_near_the_middle_whatever_it_sees():
    seen = np.random.default_rng(0).standard_normal((200, 3))
    assert np.abs(NPG(3, 2, NaturalSettings()).actor.mean(seen)).max() < 0.02


def moved_by(actions):
    """A batch on a robot that moves by a hundredth of a clipped action, from anywhere."""
    rng = np.random.default_rng(1)
    observations = np.zeros((2, len(actions), 2), np.float32)
    observations[0] = rng.uniform(-50, 50, (len(actions), 2))
    observations[1] = observations[0] + 0.01 * np.clip(actions, -1, 1)
    n = len(actions)
    return Trajectories(
        observations=observations, actions=actions[None].astype(np.float32),
        rewards=np.zeros((1, n)), lengths=np.ones(n, int), terminated=np.zeros(n, bool),
        betas=np.zeros(n), goal_steps=np.full(n, -1),
    )  # fmt: skip


def test_the_inverse_model_sees_small_changes_of_large_states():
    settings = dataclasses.replace(SMALL, inverse_hidden=(16,), inverse_epochs=40, value_batch=64)
    soil = SOIL(2, 2, settings)
    actions = np.random.default_rng(0).uniform(-1, 1, (600, 2))
    batch = moved_by(actions)
    soil.learn(batch)
    shown = Demonstrations(
        lengths=[600], observations=batch.observations[0], actions=np.zeros((600, 2)),
        next_observations=batch.observations[1], rewards=np.zeros(600),
    )  # fmt: skip
    assert np.corrcoef(soil.tell(shown).ravel(), actions.ravel())[0, 1] > 0.95


def test_the_inverse_model_remembers_the_clipped_actions_of_its_latest_batches():
    settings = dataclasses.replace(SMALL, inverse_batches=3, inverse_epochs=1)
    soil = SOIL(2, 2, settings)
    batches = [moved_by(3 * np.random.default_rng(k).standard_normal((5, 2))) for k in range(5)]
    for batch in batches:
        soil.learn(batch)
    arrays, plain = soil.state()
    assert plain["memory"] == 3
    for i, batch in enumerate(batches[-3:]):
        clipped = np.clip(batch.actions[0], -1, 1)
        assert np.abs(batch.actions).max() > 1
        np.testing.assert_array_equal(arrays[f"memory/{i}/y"], clipped)
        np.testing.assert_array_equal(arrays[f"memory/{i}/x"][:, :2], batch.observations[0])


def test_the_inverse_model_and_the_value_net_learn_at_their_own_rates():
    # the first step of Adam moves every weight by the rate, against the sign of its slope
    settings = dataclasses.replace(SMALL, inverse_rate=0.02, value_rate=0.005, value_batch=999,
                                   inverse_epochs=1, value_epochs=1)  # fmt: skip
    soil = SOIL(3, 2, settings)
    inverse, value = soil.inverse.flat.copy(), soil.value.net.flat.copy()
    soil.learn(some_batch())
    soil.value.fit(some_batch(), some_batch().rewards, np.zeros((10, 4)), 1)
    assert np.abs(soil.inverse.flat - inverse).max() == pytest.approx(0.02, rel=1e-3)
    assert np.abs(soil.value.net.flat - value).max() == pytest.approx(0.005, rel=1e-3)
    assert soil.inverse.sizes == (6, *settings.inverse_hidden, 2)


def test_a_step_moves_the_parameters_and_leaves_what_the_policy_was_normalised_by():
    actor, step = some_actor(), np.zeros(len(some_actor().flat))
    np.testing.assert_array_equal(actor.moved(step, -9.0).mean(OBSERVATIONS),
                                  actor.mean(OBSERVATIONS))  # fmt: skip
    step[-6:-3] = [0.1, 0.2, 0.3]  # the biases of the outputs, which are then stretched
    found = actor.moved(step, -9.0).mean(OBSERVATIONS) - actor.mean(OBSERVATIONS)
    expected = actor.affine["output_scale"] * [0.1, 0.2, 0.3]
    np.testing.assert_allclose(found, np.tile(expected, (len(found), 1)))


def test_conjugate_gradients_go_on_until_as_little_is_left_as_was_asked_for():
    rng = np.random.default_rng(0)
    scales, b = np.geomspace(1, 1e4, 40), rng.standard_normal(40)

    def left(**tolerance):
        x = conjugate_gradient(lambda v: scales * v, b, 400, **tolerance)
        return np.square(scales * x - b).sum() / np.square(b).sum()

    assert left() <= 1e-10
    for tolerance in (1e-2, 1e-6):
        assert tolerance / 1e3 < left(tolerance=tolerance) <= tolerance


def test_first_weights_are_uniform_within_the_root_of_their_inputs_and_the_last_are_scaled():
    (first, bias), (last, _) = networks.split(
        networks.initial((400, 25, 30), np.random.default_rng(0), last=0.01), (400, 25, 30)
    )
    assert 0.99 < np.abs(first).max() * np.sqrt(400) <= 1
    assert 0.97 < np.abs(last).max() * np.sqrt(25) / 0.01 <= 1
    assert not bias.any()


def test_a_fit_goes_through_all_data_once_an_epoch_and_in_another_order_each_time():
    net, seen = regressor(batch_size=8), []
    net._update = lambda x, y: seen.append(y[:, 0])
    x = np.random.default_rng(0).standard_normal((50, 2))
    y = np.arange(50.0)[:, None]
    net.fit(x, y, 2)
    assert [len(part) for part in seen] == [8, 8, 8, 8, 8, 8, 2] * 2
    order = np.concatenate(seen).reshape(2, 50)
    for epoch in order:
        np.testing.assert_allclose(np.sort(epoch), (y[:, 0] - 24.5) / y.std(), rtol=1e-5)
        assert not (np.diff(epoch) > 0).all()
    assert not np.array_equal(*order)
