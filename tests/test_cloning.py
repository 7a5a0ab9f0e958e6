"""Clones: a Gaussian policy earns, and scatters, as what it was cloned from."""

import dataclasses

import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.demonstration_sources import record
from revolver_lab.errors import DemonstrationsError, PolicyFileError, SettingsError
from revolver_lab.learners.natural.actor import Actor
from revolver_lab.learners.natural.cloning import EPISODES, gaussian_clone
from revolver_lab.policies import Policy

NAME = "cheetah-segment"


@pytest.fixture(scope="module")
def expert():
    return rvl.load_expert(NAME)


@pytest.fixture(scope="module")
def drawn(expert):
    return record(expert, NAME, EPISODES, seed=1, deterministic=False)


@pytest.fixture(scope="module")
def clone(expert, drawn):
    return gaussian_clone(expert, drawn)


@pytest.mark.parametrize("deterministic", [True, False])
def test_a_clone_earns_at_home_what_its_expert_earns(expert, clone, deterministic):
    theirs, mine = (
        rvl.evaluate(who, NAME, 0.0, 20, seed=7, deterministic=deterministic).mean()
        for who in (expert, clone)
    )
    assert theirs > 150
    assert mine > 0.95 * theirs


def test_a_clone_is_as_random_as_its_expert_motor_by_motor(expert, clone):
    # The expert's own spread, in states that no fit saw: the root of its actions' variance there.
    seen = record(expert, NAME, 5, seed=99).observations
    rng = np.random.default_rng(0)
    actions = np.stack([expert(seen, deterministic=False, rng=rng) for _ in range(50)])
    theirs = np.sqrt(np.square(actions - expert(seen)).mean(axis=(0, 1)))
    mine = np.exp(clone.weights["actor.log_std"])
    np.testing.assert_allclose(mine[:6], theirs[:6], rtol=0.25)
    # the lifted motor: mean 0, log_std 0, squashed: tanh of a normal number
    assert mine[6] == pytest.approx(np.std(np.tanh(rng.standard_normal(100_000))), rel=0.02)


def test_of_mean_actions_a_clone_learns_no_spread(expert):
    shown = record(expert, NAME, 10, seed=1)
    spread = gaussian_clone(expert, shown, epochs=5, floor=-1.0).weights["actor.log_std"]
    np.testing.assert_array_equal(spread, -1.0)


def test_a_clone_of_a_linear_policy_is_that_policy_in_states_it_has_not_seen():
    weights = {"actor.0.weight": np.array([[0.1, -0.2]]), "actor.0.bias": np.array([0.05])}
    teacher = Policy(weights=weights, head="tanh")
    rng = np.random.default_rng(0)
    seen = rng.uniform(-1, 1, (4000, 2)).astype(np.float32)
    shown = _shown(seen, teacher(seen))
    fitted = gaussian_clone(teacher, shown, epochs=40)
    other = rng.uniform(-1, 1, (200, 2))
    missed = fitted(other) - teacher(other)
    assert np.sqrt(np.square(missed).mean()) < 0.05 * teacher(other).std()


def test_clones_are_carried_where_their_experts_are_refused(expert, clone):
    with pytest.raises(PolicyFileError, match="gaussian_clone"):
        Actor.of(expert, 0.0)
    assert not Actor.takes(expert)
    seen = np.random.default_rng(0).standard_normal((50, 20)).astype(np.float32)
    carried = np.clip(Actor.of(clone, 0.0).mean(seen), -1, 1)
    np.testing.assert_allclose(carried, clone(seen), atol=1e-5)


def test_a_clone_is_repeated_by_its_seed_and_says_where_it_comes_from(expert, drawn):
    one, same, other = (gaussian_clone(expert, drawn, seed, epochs=1) for seed in (3, 3, 4))
    assert all(np.array_equal(w, same.weights[k]) for k, w in one.weights.items())
    assert not np.array_equal(one.weights["actor.0.weight"], other.weights["actor.0.weight"])
    assert one.card.algorithm == "SAC"
    assert drawn.origin in one.card.note
    assert one.card.episode_return is None  # nobody has measured the clone


def test_what_cannot_be_cloned_is_refused(expert, drawn):
    with pytest.raises(SettingsError, match="epochs = 0"):
        gaussian_clone(expert, drawn, epochs=0)
    short = dataclasses.replace(drawn, actions=drawn.actions[:, :6])
    with pytest.raises(DemonstrationsError, match="6"):
        gaussian_clone(expert, short)


def _shown(seen, actions):
    from revolver_lab.demonstrations import Demonstrations

    return Demonstrations(lengths=[len(seen)], observations=seen, actions=actions,
                          next_observations=seen, rewards=np.zeros(len(seen)))  # fmt: skip
