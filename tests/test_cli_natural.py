"""Natural transfers by command, on tasks without a goal: half of home is a success."""

import argparse
import dataclasses

import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab import cli, natural_population
from revolver_lab.commands import natural as commands
from revolver_lab.commands import training
from revolver_lab.errors import SettingsError
from revolver_lab.evaluation import evaluate
from revolver_lab.experts import load_expert
from revolver_lab.methods import Member
from revolver_lab.natural_methods import NATURAL_METHODS, natural_fitted
from revolver_lab.natural_population import NaturalPopulation
from revolver_lab.policies import Policy
from revolver_lab.robots import registry
from revolver_lab.runs import LearnerStatus, Plan, Status, status
from revolver_lab.tasks.locomotion import AntRun
from revolver_lab.tasks.running import SpeedTrap

NAME = "cheetah-segment"
ROW = NATURAL_METHODS["npg-direct"]


def asked(name=NAME, policy="expert", task=None):
    return argparse.Namespace(name=name, policy=policy, task=task)


def test_one_learner_and_a_run_of_them_have_the_same_method():
    (planned,) = Plan(robot=NAME, methods=["npg-direct"], seeds=[0]).methods
    assert commands.suited(asked(), [ROW]) == [planned]
    assert planned.least_return == load_expert(NAME).card.episode_return / 2


def test_a_task_with_a_goal_leaves_the_method_as_it_is():
    (found,) = commands.suited(asked("adroit-door", task="dense"), [ROW])
    assert found is ROW


def test_of_another_reward_the_expert_plays_once_to_tell_what_it_returns(capsys, monkeypatch):
    played = []
    monkeypatch.setattr(
        commands, "evaluate", lambda *a, **k: (played.append(a), evaluate(*a, **k))[1]
    )
    found, other = commands.suited(asked(task="dense"), [ROW, NATURAL_METHODS["soil"]])
    assert len(played) == 1
    assert other.least_return == found.least_return
    home = evaluate(load_expert(NAME), NAME, 0.0, 20, seed=3_000_000, task="dense").mean()
    assert found.least_return == home / 2
    assert f"returns {home:.4g} on the source" in capsys.readouterr().err


def test_an_expert_of_ones_own_is_judged_by_its_own_return(tmp_path):
    shipped = load_expert(NAME)
    weights = {name: np.zeros_like(w) for name, w in shipped.weights.items()}
    card = dataclasses.replace(shipped.card, episode_return=1e6)  # which nobody believes
    own = dataclasses.replace(shipped, weights=weights, card=card)
    own.save(tmp_path / "lazy.safetensors")
    with pytest.raises(SettingsError, match=r"returns 0 at home.*more than the 0"):
        commands.suited(asked(policy=str(tmp_path / "lazy.safetensors")), [ROW])


@pytest.mark.parametrize("home", [0.0, -12.5])
def test_half_of_nothing_is_no_success(home):
    with pytest.raises(SettingsError, match="least_return of its own"):
        natural_fitted(ROW, SpeedTrap(), home)


def test_an_ant_that_stands_still_has_no_success_and_neither_has_an_expert_that_does():
    assert natural_fitted(ROW, AntRun(), 3000.0).least_return == 2000
    with pytest.raises(SettingsError, match="more than the 1000 of a robot that does nothing"):
        natural_fitted(ROW, AntRun(), 990.0)


WITHOUT_A_GOAL = [
    (name, reward)
    for name in registry.names()
    for reward, task in registry.get(name).tasks.items()
    if task().goal_steps is None
]


@pytest.mark.parametrize(("name", "reward"), WITHOUT_A_GOAL)
def test_doing_nothing_returns_no_more_than_the_task_says(name, reward):
    env = rvl.make_vec_env(name, 4, task=reward, seed=0, autoreset_mode="NextStep")
    env.reset()
    total, alive = np.zeros(4), np.ones(4, bool)
    for _ in range(env.task.episode_steps):
        _, rewards, ended, cut, _ = env.step(np.zeros(env.action_space.shape))
        total += rewards * alive
        alive &= ~(ended | cut)
    assert total.max() <= 1.05 * env.task.idle_return + 1  # it may start with some speed
    env.close()


def test_without_a_measure_of_success_it_is_refused_before_the_expert_plays(monkeypatch):
    monkeypatch.setattr(natural_population, "record", lambda *_, **__: pytest.fail("it played"))
    for row in ("npg-direct", "soil"):
        with pytest.raises(SettingsError, match="half_of_home of the expert"):
            NaturalPopulation(NAME, [Member(method=NATURAL_METHODS[row], seed=0)],
                              expert=load_expert(NAME))  # fmt: skip


def test_how_natural_methods_are_doing_is_told_in_iterations_and_successes(capsys):
    members = [Member(method=natural_fitted(ROW, SpeedTrap(), 160.0), seed=s) for s in range(2)]
    population = NaturalPopulation(NAME, members, expert=load_expert(NAME), steps=10**9)
    left = iter(range(3))
    population.run(lambda: next(left, None) is None)
    learners = tuple(LearnerStatus(**one) for one in status.describe(population))
    now = Status(state="running", learners=learners, steps=learners[0].steps, steps_planned=10**9,
                 seconds=1.0)  # fmt: skip
    training._told()(now)
    said = capsys.readouterr().err
    made = population.loops[0].iterations
    assert len(made) == 3
    assert f"iteration 3  alpha 1.00  success {made[-1].success:.2f}" in said
    assert f"{made[-1].steps:,} steps" in said
    assert "phase" not in said


@pytest.mark.parametrize("words", [["--method", "npg-revolve"], ["--method", "revolvr"],
                                   ["--methods", "npg-revolve"]])  # fmt: skip
def test_a_misspelt_method_is_looked_for_among_all(words, capsys):
    assert cli.main(["transfer", NAME, *words]) == 2
    near = {"npg-revolve": "npg-revolver", "revolvr": "revolver"}[words[1]]
    assert f"Did you mean '{near}'" in capsys.readouterr().err


@pytest.mark.parametrize("words", [[], ["--method", "direct"], ["--seeds", "0"]])
def test_where_the_expert_is_one_of_natural_methods_one_is_named(words, capsys, tmp_path):
    root = ["--root", str(tmp_path)] if "--seeds" in words else []
    assert cli.main(["transfer", "adroit-door", *words, *root]) == 2
    assert "adroit-door --method npg-revolver." in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_command_trains_one_learner_where_nothing_tells_success(tmp_path, capsys):
    words = ["transfer", NAME, "--method", "npg-scratch", "--steps", "1", "-o", str(tmp_path)]
    assert cli.main(words) == 0
    assert "npg-scratch on cheetah-segment: 1 iterations" in capsys.readouterr().out
    policy = Policy.load(tmp_path / "policy.safetensors")
    assert rvl.evaluate(policy, NAME, 1.0, 1).shape == (1, 1)
