"""A population stopped at any tick and resumed is the one that was never stopped, bit for bit."""

import dataclasses

import numpy as np
import pytest
from small_runs import DIRECT, MANY, assert_same, population, puck, through_files, ticks, timeless
from test_transfer import LENGTH, PATH, TINY, PushRight

from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.methods import Member, Method, members
from revolver_lab.population import Population
from revolver_lab.schedule import Schedule

KINDS = [
    pytest.param(TINY, id="SAC"),
    pytest.param(dataclasses.replace(TINY, algorithm="TD3"), id="TD3"),
    pytest.param(dataclasses.replace(TINY, ent_coef="auto_0.1"), id="automatic temperature"),
    pytest.param(dataclasses.replace(TINY, buffer_size=20), id="a replay that wraps around"),
]


@pytest.fixture(scope="module")
def evolve():
    return puck()


class Falling(PushRight):
    """Ends early, and at different times, wherever the puck gets far."""

    def terminated(self, robot):
        return np.abs(robot.qpos[:, 0]) > 0.5


@pytest.mark.parametrize(
    "every", [pytest.param(1, marks=pytest.mark.slow, id="1 tick"), pytest.param(4, id="4 ticks")]
)
@pytest.mark.parametrize("settings", KINDS)
def test_stopped_again_and_again_it_ends_as_if_it_had_not(evolve, settings, every, tmp_path):
    expected = population(evolve, members(MANY, [0]), settings)
    assert expected.run()
    running = population(evolve, members(MANY, [0]), settings)
    stops = 0
    while not running.run(ticks(every)):
        stops += 1
        fresh = population(evolve, members(MANY, [0]), settings)
        running = through_files(running, fresh, tmp_path)
    assert stops > 4 * (LENGTH + 1) // every
    assert_same(running, expected)
    for one, other in zip(running.results(), expected.results()):
        assert timeless(one.to_json()) == timeless(other.to_json())
        for name, array in one.policy.weights.items():
            assert np.array_equal(array, other.policy.weights[name]), name


@pytest.mark.parametrize(
    "stop",
    [0, 3, LENGTH, LENGTH + 1, 2 * LENGTH + 1, 19],  # of 24 ticks
    ids=["before the first", "mid-episode", "at its end", "on the reset", "phase boundary", "last"],
)
def test_stopped_once_it_is_the_same_in_the_middle_and_at_the_end(evolve, stop, tmp_path):
    chosen = members([MANY[0]], [0, 1])
    task = Falling()
    stopped, straight = (population(evolve, chosen, task=task) for _ in range(2))
    assert not stopped.run(ticks(stop))
    resumed = through_files(stopped, population(evolve, chosen, task=Falling()), tmp_path)
    assert_same(resumed, stopped)
    assert not resumed.run(ticks(2))
    assert not straight.run(ticks(stop + 2))
    assert_same(resumed, straight)
    assert resumed.run()
    assert straight.run()
    assert_same(resumed, straight)


def test_episodes_that_end_early_are_resumed_too(evolve, tmp_path):
    chosen = members([MANY[0], DIRECT], [0, 1])
    straight = population(evolve, chosen, task=Falling(), steps=120)
    straight.run()
    assert straight.logs[2].phases[0].episodes > 120 // LENGTH
    running = population(evolve, chosen, task=Falling(), steps=120)
    while not running.run(ticks(5)):
        fresh = population(evolve, chosen, task=Falling(), steps=120)
        running = through_files(running, fresh, tmp_path)
    assert_same(running, straight)


def test_a_comparison_of_states_notices_one_bit(evolve):
    one, other = (population(evolve, members([DIRECT], [0])) for _ in range(2))
    for each in (one, other):
        each.run(ticks(20))
    assert_same(one, other)
    other.learner.replay.betas[0, 0] = np.nextafter(other.learner.replay.betas[0, 0], 2)
    with pytest.raises(AssertionError):
        assert_same(one, other)


def test_a_learner_is_the_same_alone_in_halves_and_in_a_crowd(evolve):
    everyone = members(MANY, [0, 3])
    crowd = population(evolve, everyone, TINY)
    crowd.run()
    results = dict(zip(everyone, crowd.results()))
    for company in ([everyone[k]] for k in (0, 5, 7)):
        compare(evolve, company, results)
    compare(evolve, everyone[1::2], results)


def compare(evolve, company, results):
    some = population(evolve, company, TINY)
    some.run()
    for member, found in zip(company, some.results()):
        expected = results[member]
        assert found.phases[-1].steps == expected.phases[-1].steps
        for part in ("phases", "evaluations"):
            assert timeless(found.to_json()[part]) == timeless(expected.to_json()[part])
        for name, array in expected.policy.weights.items():
            assert np.array_equal(array, found.policy.weights[name]), (member.name, name)


def poisoned(evolve, victim):
    """Three learners, one of which finds numbers in its replay that are none."""
    chosen = [Member(method=Method(name=name, schedule=PATH), seed=0) for name in "abc"]
    sick = population(evolve, chosen, evaluate_episodes=1)
    sick.run(ticks(10))
    sick.learner.replay.rows[victim, : sick.learner.replay.size[victim]] = np.nan
    return sick, population(evolve, chosen, evaluate_episodes=1)


def test_a_learner_whose_numbers_break_is_reported_and_its_neighbours_do_not_notice(evolve):
    sick, healthy = poisoned(evolve, 1)
    healthy.run()
    assert sick.run()
    failures = [log.failure for log in sick.results()]
    assert failures[0] == failures[2] == ""
    assert "finite" in failures[1]
    assert not sick.results()[1].reached_target
    assert sick.results()[1].steps < healthy.results()[1].steps
    assert len(sick.results()[1].evaluations) > 0
    for p in (0, 2):
        mine, theirs = sick.results()[p], healthy.results()[p]
        assert timeless(mine.to_json()) == timeless(theirs.to_json())
        for name, array in theirs.policy.weights.items():
            assert np.array_equal(array, mine.policy.weights[name]), name


def test_a_broken_learner_stays_stopped_over_a_checkpoint(evolve, tmp_path):
    sick, fresh = poisoned(evolve, 0)
    sick.run(ticks(2))
    assert sick.logs[0].failure
    resumed = through_files(sick, fresh, tmp_path)
    steps = resumed.logs[0].steps
    assert resumed.run()
    assert resumed.logs[0].steps == steps
    assert "finite" in resumed.results()[0].failure


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["ant-length-mass", "cheetah-segment", "ball-in-cup-weak-motors"])
def test_registered_robots_are_resumed_bit_for_bit(robot, tmp_path):
    settings = LearnerSettings(hidden=(8,), batch_size=8, simulations=4, learning_starts=20)
    schedule = Schedule(alpha_step=0.5, xi=0.6, episodes_per_phase=4, final_episodes=4)
    chosen = [Member(method=Method(name="path", schedule=schedule, expert=False), seed=s)
              for s in (0, 1)]  # fmt: skip

    def make():
        return Population(robot, chosen, settings=settings, evaluate_episodes=0)

    straight, running = make(), make()
    straight.run(ticks(700))
    for count in (150, 49, 1, 1, 300, 199):
        running.run(ticks(count))
        running = through_files(running, make(), tmp_path)
    assert_same(running, straight)
