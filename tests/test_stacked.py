"""The stacked engine against stable-baselines3, and against itself in other company."""

import dataclasses

import numpy as np
import pytest
import torch
from stable_baselines3.common.type_aliases import ReplayBufferSamples

from revolver_lab.learners.convert import from_sb3, tensors, to_sb3
from revolver_lab.learners.sb3 import build
from revolver_lab.learners.settings import COURSE, PAPER, LearnerSettings
from revolver_lab.learners.stacked.adam import Adam
from revolver_lab.learners.stacked.algorithm import Batch
from revolver_lab.learners.stacked.capture import CapturedUpdate
from revolver_lab.learners.stacked.layout import export, forward, fresh, mlp
from revolver_lab.learners.stacked.learner import ALGORITHMS, StackedLearner
from revolver_lab.learners.stacked.naming import adopt, policy_of
from revolver_lab.learners.stacked.replay import StackedReplay
from revolver_lab.methods import members

O, A = 5, 2  # noqa: E741
TINY = LearnerSettings(hidden=(16, 16), batch_size=12, learning_rate=1e-3, simulations=3)
SHAPES = [
    pytest.param(TINY, id="layer norm"),
    pytest.param(dataclasses.replace(TINY, layer_norm=False), id="plain"),
    pytest.param(dataclasses.replace(TINY, hidden=(16,)), id="one layer"),
    pytest.param(dataclasses.replace(PAPER, hidden=(32, 32), batch_size=12), id="paper"),
    pytest.param(dataclasses.replace(TINY, ent_coef="auto_0.1"), id="automatic temperature"),
]


def batches(settings, learners, count, seed=0):
    """Random batches, (P, B, ...) each, with some ends of episodes."""
    rng = np.random.default_rng(seed)

    def normal(*shape):
        return torch.as_tensor(rng.standard_normal(shape).astype(np.float32))

    for _ in range(count):
        size = settings.batch_size
        yield Batch(
            observation=normal(learners, size, O), action=torch.tanh(normal(learners, size, A)),
            reward=normal(learners, size), following=normal(learners, size, O),
            going_on=(normal(learners, size) > -1).float(), noise=normal(2, learners, size, A),
        )  # fmt: skip


class Given:
    """A replay of stable-baselines3 that hands out one batch."""

    def sample(self, batch_size, env=None):
        return self.batch

    def put(self, batch, p):
        self.batch = ReplayBufferSamples(
            batch.observation[p], batch.action[p], batch.following[p],
            1 - batch.going_on[p, :, None], batch.reward[p, :, None],
        )  # fmt: skip


class Drawn:
    """Hands out prepared noise wherever stable-baselines3 draws a standard normal number."""

    def __init__(self, monkeypatch):
        self.queue = []
        monkeypatch.setattr(torch.distributions.Normal, "rsample", lambda n: n.loc + n.scale
                            * self.queue.pop(0))  # fmt: skip
        monkeypatch.setattr(torch.Tensor, "normal_", lambda t, mean=0, std=1: t.copy_(
            mean + std * self.queue.pop(0)))  # fmt: skip


def twins(settings, learners=3, seed=0):
    """The same learners twice: stacked, and as models of stable-baselines3."""
    models = [build(settings, O, A, seed=seed + p) for p in range(learners)]
    stacked = ALGORITHMS[settings.name](settings, O, A, learners)
    for p, model in enumerate(models):
        stacked.begin(p)
        adopt(stacked, p, from_sb3(model))
        model.replay_buffer = Given()
    return stacked, models


def losses_of(model, monkeypatch):
    """Every loss of which stable-baselines3 takes the gradient, in order."""
    found = []
    backward = torch.Tensor.backward

    def noted(tensor, *arguments, **named):
        found.append(tensor.item())
        return backward(tensor, *arguments, **named)

    monkeypatch.setattr(torch.Tensor, "backward", noted)
    return found


def gradients_of(networks, p):
    """One learner's latest gradients by name."""
    views = networks.layout.views(networks.gradient.view(-1, networks.layout.size))
    rows = [p * networks.twins + k for k in range(networks.twins)]
    return [
        torch.as_tensor(export(name, view[row].numpy()))
        for row in rows for name, view in views.items()
    ]  # fmt: skip


def named(model):
    """Modules of a model in the order of our layouts: actor, then critics; mean before spread."""
    actor, critic = model.policy.actor, model.policy.critic
    tail = [actor.mu, actor.log_std] if hasattr(actor, "log_std") else []
    body = list(actor.latent_pi) if tail else list(actor.mu)
    return body, tail, [module for network in critic.q_networks for module in network]


def watch_gradients(model):
    """Keeps each network's gradients at the moment its optimiser steps, in our order."""
    body, tail, critics = named(model)
    found = {}

    def actor(*_):
        found["actor"] = [p.grad.clone() for module in body for p in module.parameters()]
        for kind in ("weight", "bias") if tail else ():
            found["actor"].append(torch.cat([getattr(m, kind).grad for m in tail]))

    def critic(*_):
        found["critic"] = [p.grad.clone() for module in critics for p in module.parameters()]

    model.policy.actor.optimizer.register_step_pre_hook(actor)
    model.policy.critic.optimizer.register_step_pre_hook(critic)
    return found


@pytest.mark.parametrize("settings", SHAPES)
@pytest.mark.parametrize("algorithm", ["SAC", "TD3"])
def test_an_update_is_that_of_stable_baselines3(settings, algorithm, monkeypatch):
    settings = dataclasses.replace(settings, algorithm=algorithm)
    stacked, models = twins(settings)
    everyone, drawn = torch.ones(3, 1, dtype=torch.bool), Drawn(monkeypatch)
    gradients = [watch_gradients(model) for model in models]
    for k, batch in enumerate(batches(settings, 3, 4), start=1):
        with_actor = algorithm == "SAC" or k % settings.policy_delay == 0
        stacked.losses.clear()
        assert stacked.update(batch, everyone, everyone, with_actor).all()
        for p, model in enumerate(models):
            model.replay_buffer.put(batch, p)
            drawn.queue = [batch.noise[1, p], batch.noise[0, p]]
            if algorithm == "TD3":
                drawn.queue = [batch.noise[0, p]]
            with monkeypatch.context() as patch:
                theirs = losses_of(model, patch)
                model.train(1, settings.batch_size)
            order = ["ent_coef", "critic", "actor"]
            ours = [stacked.losses[name][p].item() for name in order if name in stacked.losses]
            assert np.allclose(ours, theirs, rtol=1e-5, atol=1e-5), (ours, theirs)
            for part in ("critic", "actor")[: 1 + with_actor]:
                ours = gradients_of(getattr(stacked, part), p)
                for mine, other in zip(ours, gradients[p][part], strict=True):
                    assert torch.allclose(mine, other, rtol=1e-5, atol=1e-5)
            mine, other = policy_of(stacked, p).weights, tensors(model)
            assert set(mine) == set(other)
            for name, array in mine.items():
                assert np.allclose(array, other[name].detach(), rtol=1e-5, atol=1e-5), name


def test_actions_are_drawn_as_stable_baselines3_draws_them(monkeypatch):
    stacked, models = twins(TINY)
    observation, noise = torch.randn(3, 4, O), torch.randn(3, 4, A)
    drawn = Drawn(monkeypatch)
    ours = stacked.explore(observation, noise)
    for p, model in enumerate(models):
        drawn.queue = [noise[p]]
        with torch.no_grad():
            assert torch.allclose(ours[p], model.actor(observation[p]), atol=1e-6)


def test_a_policy_goes_in_and_comes_out_unchanged():
    for algorithm in ("SAC", "TD3"):
        settings = dataclasses.replace(TINY, algorithm=algorithm)
        stacked, models = twins(settings)
        for p, model in enumerate(models):
            again = to_sb3(policy_of(stacked, p), build(settings, O, A, seed=99))
            for name, array in tensors(model).items():
                assert torch.equal(array, tensors(again)[name]), name


def test_the_layers_are_those_of_torch():
    layout = mlp([O, 7, 6, A], norm=True)
    rng, x = np.random.default_rng(0), torch.randn(2, 4, O)
    flat = torch.zeros(2, layout.size)
    views = layout.views(flat)
    modules = []
    for p in range(2):
        drawn = fresh(layout, rng)
        for name, array in drawn.items():
            views[name][p] = torch.as_tensor(array)
        stack, width = [], O
        for i, units in enumerate((7, 6, A)):
            linear = torch.nn.Linear(width, units)
            weight, bias = views[f"{i}.weight"][p], views[f"{i}.bias"][p]
            linear.weight.data, linear.bias.data = weight.T, bias[0]
            stack += [linear] + ([torch.nn.LayerNorm(units), torch.nn.ReLU()] if i < 2 else [])
            width = units
        modules.append(torch.nn.Sequential(*stack))
    expected = torch.stack([module(x[p]) for p, module in enumerate(modules)])
    assert torch.allclose(forward(views, x), expected, atol=1e-6)


@pytest.mark.parametrize("fused", [True, False])
def test_adam_is_torchs_and_moves_only_who_is_asked(fused):
    weights = torch.randn(3, 20)
    theirs = [row.clone().requires_grad_() for row in weights]
    optimisers = [torch.optim.Adam([row], lr=0.01) for row in theirs]
    ours = Adam(weights, 0.01)
    rng = np.random.default_rng(0)
    for _ in range(30):
        gradient = torch.randn(3, 20)
        mask = rng.random(3) < 0.6
        step = ours.step if fused else ours._step_masked  # the latter is a device's
        step(gradient, torch.as_tensor(mask[:, None]))
        for p in np.flatnonzero(mask):
            theirs[p].grad = gradient[p].clone()
            optimisers[p].step()
    assert torch.allclose(weights, torch.stack(theirs).detach(), atol=1e-6)


def trained(settings, seeds, updates, method="revolver"):
    """Learners that have stored random transitions and learnt from them."""
    learner = StackedLearner(settings, O, A, members([method], seeds), capacity=50)
    for p in range(len(seeds)):
        learner.enter(p, 0.0)
    streams = [np.random.default_rng(seed) for seed in seeds]
    n, every = len(seeds) * 3, np.ones(len(seeds), dtype=bool)
    for _ in range(updates):
        rows = [rng.standard_normal((3, 2 * O + 2)) for rng in streams]
        block = np.concatenate(rows).astype(np.float32)
        learner.store(np.ones(n, dtype=bool), block[:, :O], learner.act(block[:, :O]),
                      block[:, -1], block[:, O : 2 * O], block[:, -2] > 1,
                      np.full(n, 0.05))  # fmt: skip
        learner.update(every)
    return learner


@pytest.mark.parametrize("algorithm", ["SAC", "TD3"])
@pytest.mark.parametrize("base", [COURSE, PAPER], ids=["course", "paper"])
def test_a_seed_means_the_same_in_any_company_bit_for_bit(algorithm, base):
    small = {} if base is COURSE else {"hidden": (32, 256), "batch_size": 64}
    settings = dataclasses.replace(base, algorithm=algorithm, simulations=3, learning_starts=6,
                                   **small)  # fmt: skip
    crowd = trained(settings, range(20), 25)
    for p in (0, 7, 19):
        alone = trained(settings, [p], 25)
        for name, array in alone.policy(0).weights.items():
            assert np.array_equal(array, crowd.policy(p).weights[name]), name
    assert not np.array_equal(crowd.policy(0).weights["actor.0.weight"],
                              crowd.policy(1).weights["actor.0.weight"])  # fmt: skip


def test_a_learner_whose_numbers_break_stops_and_its_neighbours_go_on():
    settings = dataclasses.replace(TINY, learning_starts=6)
    healthy = trained(settings, [0, 1, 2], 20)
    learner = StackedLearner(settings, O, A, members(["revolver"], [0, 1, 2]), capacity=50)
    streams = [np.random.default_rng(seed) for seed in range(3)]
    for k in range(20):
        block = np.concatenate([r.standard_normal((3, 2 * O + 2)) for r in streams])
        block = block.astype(np.float32)
        reward = block[:, -1].copy()
        if k == 10:
            reward[3:6] = np.inf  # of learner 1
        learner.store(np.ones(9, dtype=bool), block[:, :O], learner.act(block[:, :O]), reward,
                      block[:, O : 2 * O], block[:, -2] > 1, np.full(9, 0.05))  # fmt: skip
        learner.update(np.ones(3, dtype=bool))
    assert learner.broken.tolist() == [False, True, False]
    assert all(np.isfinite(array).all() for array in learner.policy(1).weights.values())
    for p in (0, 2):
        for name, array in healthy.policy(p).weights.items():
            assert np.array_equal(array, learner.policy(p).weights[name]), name


@pytest.mark.parametrize("algorithm", ["SAC", "TD3"])
def test_the_path_of_captured_graphs_gives_the_same_numbers(algorithm):
    settings = dataclasses.replace(TINY, algorithm=algorithm, ent_coef="auto")
    (plain, _), (other, _) = twins(settings), twins(settings)
    captured = CapturedUpdate(other)
    mask = torch.tensor([[True], [False], [True]])
    for k, batch in enumerate(batches(settings, 3, 6)):
        for update in (plain.update, captured):
            update(batch, mask, mask, k % 2 == 0)
    for p in range(3):
        for name, array in policy_of(plain, p).weights.items():
            assert np.array_equal(array, policy_of(other, p).weights[name]), name
    assert len(captured._replays) == 2  # with the actor, and without


def filled(latest=None):
    replay = StackedReplay(2, 10, 1, 1)
    for k in range(14):  # learner 1 wraps around, learner 0 stays half empty
        owner = np.array([0, 1]) if k < 5 else np.array([1])
        m = len(owner)
        value = np.full((m, 1), float(k))
        replay.extend(owner, value, value, value[:, 0], value + 0.5, np.full(m, k % 2 == 0),
                      np.full(m, k / 20))  # fmt: skip
    return replay


def test_a_replay_holds_the_latest_and_cleaning_keeps_their_order():
    replay = filled()
    assert replay.size.tolist() == [5, 10]
    assert replay.dump(1)[0][:, 0].tolist() == list(range(4, 14))
    assert replay.clean(1, 0.3, 0.5) == 5
    assert replay.dump(1)[0][:, 0].tolist() == [6, 7, 8, 9, 10]
    assert replay.dump(0)[0][:, 0].tolist() == [0, 1, 2, 3, 4]
    replay.extend(np.array([1]), *[np.array([[99.0]])] * 2, np.array([99.0]), np.array([[99.0]]),
                  np.array([False]), np.array([0.4]))  # fmt: skip
    assert replay.dump(1)[0][:, 0].tolist() == [6, 7, 8, 9, 10, 99]


def test_the_latest_are_kept_where_their_number_is_bounded():
    replay = filled()
    assert replay.clean(1, -np.inf, np.inf, latest=3) == 3
    assert replay.dump(1)[0][:, 0].tolist() == [11, 12, 13]
    assert replay.clean(0, 1.0, 2.0) == 0


def test_what_is_gathered_is_what_was_stored():
    replay, rng = filled(), np.random.default_rng(0)
    places = np.stack([replay.draw(p, 200, rng) for p in range(2)])
    weights = rng.uniform(1, 2, (2, 200))
    batch = replay.gather(places, weights, np.zeros((2, 2, 200, 1), np.float32))
    seen = batch.observation[..., 0]
    assert torch.equal(batch.following[..., 0], seen + 0.5)
    assert torch.equal(batch.going_on, (seen % 2).float())
    assert np.allclose(batch.reward, seen.numpy() * weights, rtol=1e-6)
    assert set(seen[0].tolist()) == set(range(5))
    assert set(seen[1].tolist()) == set(range(4, 14))


def test_shaping_multiplies_what_is_sampled_and_not_what_is_stored():
    settings = dataclasses.replace(TINY, learning_starts=6)
    chosen = members(["revolver", "revolver-h1", "revolver-h1-normalised"], [0])
    learner = StackedLearner(settings, O, A, chosen, capacity=50)
    for p in range(3):
        learner.enter(p, 0.2)
    ones = np.ones(9)
    learner.store(ones > 0, np.zeros((9, O)), np.zeros((9, A)), ones, np.zeros((9, O)), ones < 0,
                  np.tile([0.2, 0.26, 0.32], 3))  # fmt: skip
    places = np.tile(np.arange(3), (3, 1))
    plain, absolute, normalised = learner._weights(places, ones[:3] > 0)
    assert np.array_equal(plain, np.ones(3))
    assert np.allclose(absolute, np.exp([0.2, 0.26, 0.32]))
    width = 0.12  # 1 = mean of c exp(beta - 0.2) over U(0.2, 0.32)
    assert np.allclose(normalised, np.exp([0, 0.06, 0.12]) * width / (np.exp(width) - 1))
    assert (learner.replay.rows[:, :3, 2 * O + A] == 1).all()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"engine": "jax"}, "engine = 'jax'"),
        ({"engine": "stacked", "algorithm": "DDPG"}, "engine = 'stacked'"),
        ({"ent_coef": "automatic"}, "ent_coef = 'automatic'"),
        ({"ent_coef": "auto_0"}, "ent_coef = 'auto_0'"),
        ({"ent_coef": -1.0}, "ent_coef = -1.0"),
        ({"policy_delay": 0}, "policy_delay = 0"),
        ({"batch_size": 2.5}, "batch_size = 2.5"),
        ({"gamma": float("nan")}, "gamma = nan"),
        ({"hidden": ()}, r"hidden = \(\)"),
    ],
)
def test_settings_that_cannot_work_are_refused(change, text):
    from revolver_lab.errors import SettingsError

    with pytest.raises(SettingsError, match=text):
        dataclasses.replace(TINY, **change)


def test_a_temperature_of_zero_is_allowed():
    learner = trained(dataclasses.replace(TINY, ent_coef=0.0, learning_starts=6), [0], 5)
    assert not learner.broken.any()


def test_the_window_of_a_phase_survives_and_nothing_else():
    learner = trained(dataclasses.replace(TINY, learning_starts=6), [0], 5)
    assert learner.replay.size[0] == 15
    assert learner.enter(0, 0.04) == 15  # beta = 0.05 is in [0.04, 0.16]
    assert learner.enter(0, 0.08) == 0


def test_fresh_optimisers_begin_anew_in_each_phase():
    for name, moments in (("revolver", 5), ("optimiser-fresh", 0)):
        learner = trained(dataclasses.replace(TINY, learning_starts=3), [0], 5, name)
        assert learner.algorithm.critic.adam.count.item() == 5
        learner.enter(0, 0.04)
        assert learner.algorithm.critic.adam.count.item() == moments
