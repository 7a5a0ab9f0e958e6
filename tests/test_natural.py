"""NPG, DAPG and SOIL: trajectories, updates, equalities bit for bit, and learning."""

import dataclasses
import math

import numpy as np
import pytest
from natural_puck import EXPERT, LENGTH, Barren, Failing, Reach, feedback, puck

from revolver_lab.demonstration_sources import record
from revolver_lab.envs import snapshot
from revolver_lab.envs.vector import make_vec_env
from revolver_lab.errors import (
    DemonstrationsError,
    PolicyFileError,
    SettingsError,
    UnknownNameError,
)
from revolver_lab.learners.natural import gaussian
from revolver_lab.learners.natural.algorithms import ALGORITHMS, make_learner
from revolver_lab.learners.natural.dapg import DAPG
from revolver_lab.learners.natural.imitating import imitation_weight
from revolver_lab.learners.natural.npg import NPG
from revolver_lab.learners.natural.settings import PILOT, PUBLISHED, NaturalSettings
from revolver_lab.learners.natural.soil import SOIL
from revolver_lab.policies import Policy
from revolver_lab.trajectories import Success, sample

TINY = NaturalSettings(
    trajectories=8, length=LENGTH, hidden=(8,), value_hidden=(16,), warm_batches=2,
    inverse_hidden=(16,), gamma=0.97, value_batch=32, inverse_epochs=5,
)  # fmt: skip


@pytest.fixture(scope="module")
def evolve():
    return puck()


@pytest.fixture(scope="module")
def teacher(evolve):
    return record(EXPERT, evolve, 20, task=Reach())


def environment(evolve, task=None, n=8, alphas=0.0):
    return make_vec_env(evolve, n, task=task or Reach(), alphas=alphas, seed=0, nthread=1,
                        autoreset_mode="NextStep")  # fmt: skip


def window(simulation, rng):
    return rng.uniform(0.2, 0.5)


def same(one, other):
    """Whether two learners are equal to the last bit."""
    arrays, plain = one.state()
    others, other_plain = other.state()
    shared = set(arrays) & set(others)
    assert {k for k in arrays if not k.startswith(("inverse", "memory"))} <= shared
    return all(np.array_equal(arrays[k], others[k]) for k in shared if "inverse" not in k) and (
        plain["streams"]["actions"] == other_plain["streams"]["actions"]
    )


def test_a_trajectory_is_what_a_loop_over_single_steps_sees(evolve):
    act = lambda _, seen: EXPERT(seen)  # noqa: E731
    played = sample(environment(evolve, n=3), act, LENGTH)
    env = environment(evolve, n=3)
    seen, _ = env.reset()
    for t in range(LENGTH):
        assert np.array_equal(played.observations[t], seen)
        seen, reward, *_ = env.step(EXPERT(seen))
        assert np.array_equal(played.rewards[t], reward)
        assert np.array_equal(played.observations[t + 1], seen)
    held = (np.abs(played.observations[1:, :, 0]) < 0.3).sum(axis=0)
    assert np.array_equal(played.goal_steps, held)
    assert played.steps == 3 * LENGTH


def test_trajectories_end_where_they_fail_and_the_others_go_on(evolve):
    away = feedback([3.0, 3.0])
    env = environment(evolve, Failing())
    played = sample(env, lambda _, seen: away(seen), LENGTH)
    assert played.terminated.all()
    assert played.lengths.min() < played.lengths.max() < LENGTH
    for i, length in enumerate(played.lengths):
        x = np.abs(played.observations[: length + 1, i, 0])
        assert x[-1] > 2.5
        assert (x[:-1] <= 2.5).all()
        assert not played.rewards[length:, i].any()
    assert played.inside.sum() == played.steps == played.lengths.sum()
    assert not env.halted.any()


def test_every_trajectory_runs_on_its_own_robot(evolve):
    env = environment(evolve)
    npg = NPG(2, 2, TINY)
    first, second = (npg.iterate(env, window).betas for _ in range(2))
    assert len(np.unique([*first, *second])) == 16
    assert (first >= 0.2).all()
    assert (first <= 0.5).all()
    report = npg.iterate(env, lambda simulation, rng: 1.0)
    assert (report.betas == 1).all()


def test_shorter_trajectories_than_episodes_are_no_failures(evolve):
    npg = NPG(2, 2, dataclasses.replace(TINY, length=7))
    played = npg.sample(environment(evolve))
    assert (played.lengths == 7).all()
    assert not played.terminated.any()


def test_an_iteration_moves_by_the_kl_that_was_asked_for(evolve):
    npg = NPG(2, 2, dataclasses.replace(TINY, step_size=0.01))
    npg.adopt(EXPERT)
    report = npg.iterate(environment(evolve), window)
    assert report.kl == pytest.approx(0.005, rel=0.15)
    assert report.steps == 3 * 8 * LENGTH  # two batches to warm up, and this one
    assert report.finite


def test_where_nothing_was_ever_earned_the_policy_stays(evolve):
    npg = NPG(2, 2, TINY)
    before = npg.policy()
    for _ in range(2):
        assert npg.iterate(environment(evolve, Barren()), window).kl == 0
    after = npg.policy()
    assert all(np.array_equal(after.weights[k], v) for k, v in before.weights.items())


def test_log_std_is_learnt_and_stops_at_the_floor(evolve):
    npg = NPG(2, 2, dataclasses.replace(TINY, log_std_floor=-0.5, step_size=0.2))
    npg.adopt(feedback([-2.0, -1.5], log_std=-0.5))
    spreads = [npg.iterate(environment(evolve), window).log_std for _ in range(6)]
    assert min(spreads) == -0.5
    free = NPG(2, 2, dataclasses.replace(TINY, log_std_floor=-3.0, step_size=0.2))
    free.adopt(feedback([-2.0, -1.5], log_std=-0.5))
    assert min(free.iterate(environment(evolve), window).log_std for _ in range(6)) < -0.5


def test_log_std_may_have_a_step_and_a_kl_of_its_own(evolve):
    settings = dataclasses.replace(TINY, step_size=0.01, noise_step_size=0.002)
    npg = NPG(2, 2, settings)
    npg.adopt(EXPERT)
    before = npg.actor
    report = npg.iterate(environment(evolve), window)
    change = npg.actor.log_std - before.log_std
    # KL(N(m, s e^d) | N(m, s)) = sum (e^2d - 1) / 2 - d, to second order sum d^2: half of 0.002
    assert np.square(change).sum() == pytest.approx(0.001, rel=1e-4)
    assert report.kl == pytest.approx((0.01 + 0.002) / 2, rel=0.15)


def test_noise_that_does_harm_goes_soon_only_where_it_has_a_step_of_its_own(evolve):
    spreads = {}
    for own in (None, 0.02):
        settings = dataclasses.replace(TINY, trajectories=32, noise_step_size=own)
        npg, env = NPG(2, 2, settings), environment(evolve, n=32)
        npg.adopt(feedback([-2.0, -1.5], log_std=0.5))
        for _ in range(25):
            npg.iterate(env, lambda *_: 0.0)
        spreads[own] = npg.actor.log_std[0]  # of the motor that moves the puck
    assert spreads[0.02] < spreads[None] - 0.2 < 0.5


def test_shaping_weighs_later_robots_more(evolve):
    def features_and_targets(shaping):
        npg = NPG(2, 2, dataclasses.replace(TINY, warm_batches=0, bootstrap=False))
        npg.adopt(EXPERT)
        npg.iterate(environment(evolve), window, shaping=shaping)
        return npg.value.state()[0]

    plain, shaped = features_and_targets(0.0), features_and_targets(2.0)
    beta = plain["last_x"][:, -1]
    assert np.allclose(shaped["last_y"][:, 0], np.exp(2 * beta) * plain["last_y"][:, 0], rtol=1e-5)


def test_the_value_net_knows_the_time_and_can_be_kept_from_the_robot(evolve):
    npg, blind = NPG(2, 2, TINY), NPG(2, 2, dataclasses.replace(TINY, value_beta=False))
    env = environment(evolve)
    env.draw_alpha = window
    batch = npg.sample(env)
    known, less = npg.value.features(batch), blind.value.features(batch)
    assert np.array_equal(known[..., :-1], less)
    assert np.allclose(known[:, :, -1], batch.betas)
    assert np.allclose(known[5, :, 2:5], [0.25, 0.25**2, 0.25**3])


def test_the_value_net_foresees_the_experts_returns_once_it_is_warm(evolve):
    npg = NPG(2, 2, dataclasses.replace(TINY, warm_batches=8, warm_epochs=60))
    npg.adopt(EXPERT)
    assert npg.iterate(environment(evolve), lambda *_: 0.0).explained > 0.7


def test_dapg_without_demonstrations_is_npg_bit_for_bit(evolve, teacher):
    npg, dapg = NPG(2, 2, TINY), DAPG(2, 2, TINY, demonstrations=None)
    with_some = DAPG(2, 2, TINY, demonstrations=teacher)
    for learner in (npg, dapg, with_some):
        env = environment(evolve)
        for _ in range(3):
            learner.iterate(env, window)
    assert same(npg, dapg)
    assert not same(npg, with_some)


@pytest.mark.parametrize("kind", [DAPG, SOIL])
def test_imitation_of_no_weight_is_npg_bit_for_bit(evolve, teacher, kind):
    npg = NPG(2, 2, TINY)
    still = kind(2, 2, dataclasses.replace(TINY, imitation_weight=0.0), demonstrations=teacher)
    weighty = kind(2, 2, TINY, demonstrations=teacher)
    for learner in (npg, still, weighty):
        env = environment(evolve)
        for _ in range(3):
            learner.iterate(env, window)
    assert same(npg, still)
    assert not same(npg, weighty)


def test_imitation_fades_and_needs_no_reward():
    advantages = np.array([-1.0, 3.0, 0.5])
    weights = [imitation_weight(PILOT, k, advantages) for k in (0, 1, 10)]
    assert np.allclose(weights, [0.3, 0.3 * 0.95, 0.3 * 0.95**10])
    assert imitation_weight(PILOT, 0, np.zeros(3)) == 0.1


@pytest.mark.parametrize("kind", [DAPG, SOIL])
def test_a_teacher_moves_the_policy_even_without_reward(evolve, teacher, kind):
    learner = kind(2, 2, TINY, demonstrations=teacher)
    env = environment(evolve, Barren())

    def likelihood():
        mean = learner.actor.mean(teacher.observations)
        return gaussian.log_density(teacher.actions, mean, learner.actor.log_std).mean()

    found = [likelihood()]
    for _ in range(6):
        assert learner.iterate(env, lambda *_: 0.0).kl > 0
        found.append(likelihood())
    assert found[-1] > found[0] + 0.1
    assert found[1] > found[0] or kind is SOIL  # SOIL has to learn its model first


def test_soils_inverse_model_tells_the_action_between_two_states(evolve, teacher):
    # On the target the new motor does what the old one did: the teacher never used it.
    soil = SOIL(2, 2, TINY, demonstrations=teacher)
    env = environment(evolve, alphas=1.0)
    for _ in range(25):
        soil.iterate(env)
    told = soil.tell(dataclasses.replace(teacher, actions=np.ones_like(teacher.actions)))
    assert np.abs(told).max() <= 1
    assert not teacher.actions[:, 1].any()
    assert np.corrcoef(told[:, 1], teacher.actions[:, 0])[0, 1] > 0.8


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_resumed_learner_goes_on_bit_for_bit(evolve, teacher, algorithm):
    demonstrations = None if algorithm == "NPG" else teacher
    whole, half, rest = (
        make_learner(algorithm, 2, 2, TINY, demonstrations=demonstrations, seed=s)
        for s in (3, 3, 9)
    )
    env = environment(evolve)
    for _ in range(4):
        whole.iterate(env, window)
    env = environment(evolve)
    for _ in range(2):
        half.iterate(env, window)
    held, other = snapshot.take(env), environment(evolve)
    snapshot.put_back(other, *held)
    rest.restore(*half.state())
    for _ in range(2):
        rest.iterate(other, window)
    assert same(whole, rest)
    arrays, others = whole.state()[0], rest.state()[0]
    assert set(arrays) == set(others)
    assert all(np.array_equal(v, others[k]) for k, v in arrays.items())


def test_what_travels_along_is_not_in_the_way(evolve):
    npg = NPG(2, 2, TINY)
    npg.iterate(environment(evolve), window)
    full = npg.policy(value=True)
    assert any(name.startswith("value.") for name in full.weights)
    seen = np.ones((3, 2), np.float32)
    assert np.array_equal(full(seen), full.without_critic()(seen))
    assert set(full.without_critic().weights) == set(npg.policy().weights)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_all_three_learn_the_task_from_scratch(evolve, teacher, algorithm):
    demonstrations = None if algorithm == "NPG" else teacher
    settings = dataclasses.replace(TINY, trajectories=32, hidden=(16,))
    learner = make_learner(algorithm, 2, 2, settings, demonstrations=demonstrations, seed=1)
    env = environment(evolve, n=32)
    success = [learner.iterate(env, lambda *_: 0.0).success for _ in range(50)]
    assert np.mean(success[:2]) < 0.5
    assert np.mean(success[-5:]) > 0.9


def test_success_can_be_the_tasks_goal_or_a_return(evolve):
    env = environment(evolve)
    played = sample(env, lambda _, seen: EXPERT(seen), LENGTH)
    assert np.array_equal(Success()(env, played), played.goal_steps > 5)
    assert np.array_equal(Success(goal_steps=12)(env, played), played.goal_steps > 12)
    assert np.array_equal(Success(least_return=9.0)(env, played), played.returns >= 9)


@pytest.mark.parametrize(
    "changes",
    [
        {"trajectories": 0}, {"length": 1.5}, {"step_size": 0.0}, {"gamma": 1.1}, {"gae": -0.1},
        {"damping": -1}, {"hidden": ()}, {"bootstrap": 1}, {"log_std_floor": 1.0},
        {"warm_batches": -1}, {"imitation_decay": float("nan")}, {"value_beta": None},
        {"carried_noise": 0}, {"carried_noise": "half"}, {"noise_step_size": 0},
    ],
)  # fmt: skip
def test_settings_that_cannot_work_are_refused_by_name(changes):
    with pytest.raises(SettingsError) as caught:
        NaturalSettings(**changes)
    assert "log_std_start" in str(caught.value) or next(iter(changes)) in str(caught.value)


def test_settings_travel_as_json():
    quiet = dataclasses.replace(PUBLISHED, carried_noise=0.5)
    assert NaturalSettings.from_json(PUBLISHED.to_json()) == PUBLISHED
    assert NaturalSettings.from_json(quiet.to_json()) == quiet != PUBLISHED
    assert not PUBLISHED.bootstrap


def test_a_setting_that_came_later_renames_no_folder():
    later = dataclasses.replace(PUBLISHED, carried_noise=0.5, noise_step_size=0.01)
    assert not {"carried_noise", "noise_step_size"} & set(PUBLISHED.to_json())
    assert later.to_json() == PUBLISHED.to_json() | {"carried_noise": 0.5, "noise_step_size": 0.01}


@pytest.mark.parametrize(("noise", "held"), [(0.5, 0.5), (1.0, 1.0), (3.0, 3.0), (1e-9, 0.1)])
def test_a_carried_expert_keeps_its_mean_and_changes_its_noise(evolve, noise, held):
    floor = NaturalSettings(carried_noise=noise, log_std_floor=math.log(0.1))
    npg, usual = NPG(2, 2, floor), NPG(2, 2, TINY)
    npg.adopt(EXPERT)
    usual.adopt(EXPERT)
    seen = np.ones((3, 2), np.float32)
    assert np.array_equal(npg.actor.mean(seen), usual.actor.mean(seen))
    spread = np.exp(npg.actor.log_std) / np.exp(usual.actor.log_std)
    expected = held if noise > 1e-3 else held / np.exp(usual.actor.log_std)
    assert np.allclose(spread, expected)
    assert np.array_equal(EXPERT.weights["actor.log_std"], usual.actor.log_std)


@pytest.mark.parametrize("noise", [0.5, 1.0, 1.5])
def test_a_carried_expert_narrower_than_the_floor_begins_at_the_floor(noise):
    npg = NPG(2, 2, NaturalSettings(carried_noise=noise, log_std_floor=-2.5))
    npg.adopt(feedback([-2.0, -1.5], log_std=-5.0))
    assert (npg.actor.log_std == -2.5).all()


def test_what_does_not_fit_is_refused(evolve, teacher):
    with pytest.raises(PolicyFileError, match="squashed_gaussian"):
        NPG(2, 2, TINY).adopt(
            Policy(weights=EXPERT.parameters(), head="squashed_gaussian", activation="tanh")
        )
    with pytest.raises(PolicyFileError, match="2 observations"):
        NPG(3, 2, TINY).adopt(EXPERT)
    with pytest.raises(UnknownNameError, match="NPG, DAPG, SOIL"):
        make_learner("PPO", 2, 2)
    with pytest.raises(SettingsError, match="DAPG without demonstrations"):
        make_learner("DAPG", 2, 2)
    with pytest.raises(DemonstrationsError, match="3 observations"):
        DAPG(3, 2, demonstrations=teacher)


def test_actions_are_scattered_about_the_mean_as_log_std_says():
    env = make_vec_env(puck(), 8, task=Reach(), seed=0, nthread=1, autoreset_mode="NextStep")
    npg = NPG(2, 2, NaturalSettings(trajectories=8, length=LENGTH))
    npg.actor.log_std[:] = [-1.0, 0.5]
    apart = []
    for _ in range(4):
        played = npg.sample(env)
        apart.append(played.actions - npg.actor.mean(played.observations[:-1]))
    found = np.concatenate(apart).reshape(-1, 2)  # 640 of each; standard error 3 %
    np.testing.assert_allclose(found.std(axis=0), np.exp([-1.0, 0.5]), rtol=0.14)
    assert (np.abs(found.mean(axis=0)) < 5 * found.std(axis=0) / np.sqrt(640)).all()


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_every_learner_draws_all_that_is_random_from_its_own_seed(algorithm):
    shown = None if algorithm == "NPG" else record(EXPERT, puck(), 2, task=Reach())
    one, same, other = (
        make_learner(algorithm, 2, 2, demonstrations=shown, seed=seed) for seed in (3, 3, 4)
    )
    assert np.array_equal(one.actor.flat, same.actor.flat)
    assert not np.array_equal(one.actor.flat, other.actor.flat)
    draws = [learner.streams["actions"].random() for learner in (one, same, other)]
    assert draws[0] == draws[1] != draws[2]


def test_a_policy_as_noisy_as_no_motor_can_act_is_refused():
    NaturalSettings(log_std_start=2.0)
    with pytest.raises(SettingsError, match=r"log_std_start = 2\.5"):
        NaturalSettings(log_std_start=2.5)
