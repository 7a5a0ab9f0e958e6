"""Shipped experts: as good as their card on the source, lost on the target, without torch."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

from revolver_lab.errors import PolicyFileError, SettingsError, UnknownNameError
from revolver_lab.evaluation import evaluate
from revolver_lab.experts import (
    RECIPES,
    Stage,
    course_learner,
    expert_folder,
    load_expert,
    train_expert,
)
from revolver_lab.learners.settings import COURSE
from revolver_lab.policies import Policy
from revolver_lab.robots import registry
from revolver_lab.robots.ant import ant_places

CHEETAHS = ["cheetah-front-leg", "cheetah-short-legs", "cheetah-long-legs"]


@pytest.mark.parametrize("name", CHEETAHS)
def test_an_expert_is_shipped_with_its_card(name):
    card = load_expert(name).card
    assert card.robot == name
    assert card.alpha == 0.0
    assert card.episode_return > 140
    assert {"mujoco", "torch", "stable-baselines3"} <= set(card.versions)
    assert card.command.startswith("revolver-lab train-expert")
    assert (expert_folder() / f"{name}.json").is_file()


def test_the_cheetahs_share_one_expert():
    first, *others = [load_expert(name).weights for name in CHEETAHS]
    for other in others:
        assert all((first[key] == other[key]).all() for key in first)


def test_the_segments_expert_is_the_cheetahs_lifted_and_as_good():
    from revolver_lab.robots.cheetah_segment import cheetah_places

    columns, observations, rows, actions = cheetah_places()
    expected = load_expert("cheetah-front-leg").lifted(columns, observations, rows, actions)
    shipped = load_expert("cheetah-segment")
    assert all((shipped.weights[key] == array).all() for key, array in expected.weights.items())
    assert abs(shipped.card.episode_return - load_expert(CHEETAHS[0]).card.episode_return) < 5


@pytest.fixture(scope="module")
def walks():
    """Returns of the Ant's expert: on its source, on its target, and with feet of no size."""
    source, target = evaluate(load_expert("ant-length-mass"), "ant-length-mass", [0.0, 1.0],
                              episodes=12, seed=5)  # fmt: skip
    feet = evaluate(load_expert("ant-leg-emerge"), "ant-leg-emerge", 0.0, episodes=12, seed=5)[0]
    return source, target, feet


def test_the_ants_expert_is_as_good_with_feet_of_no_size(walks):
    expected = load_expert("ant-length-mass").lifted(*ant_places())
    shipped = load_expert("ant-leg-emerge")
    assert all((shipped.weights[key] == array).all() for key, array in expected.weights.items())
    source, _, feet = walks
    error = np.hypot(source.std(), feet.std()) / np.sqrt(12)
    assert abs(source.mean() - feet.mean()) < 3 * error


def test_the_ants_expert_walks_on_the_source_and_not_on_legs_of_other_lengths(walks):
    source, target, _ = walks
    # 1000 is all that an Ant can get without moving forward.
    assert np.quantile(source, 0.75) > 1000
    assert target.mean() < 0


def test_every_robot_at_course_scale_has_an_expert_that_its_learners_can_take_over():
    from revolver_lab.learners.stacked.learner import StackedLearner
    from revolver_lab.methods import members

    for name in RECIPES:
        expert = load_expert(name)
        sizes = expert.observation_size, expert.action_size
        learner = StackedLearner(course_learner(name), *sizes, members(["revolver"], [0]), 10)
        learner.adopt(0, expert)
        for key, array in expert.weights.items():
            assert (learner.policy(0).weights[key] == array).all(), (name, key)


def test_an_expert_brings_its_critics_and_targets():
    networks = {key.rsplit(".", 2)[0] for key in load_expert(CHEETAHS[0]).weights}
    assert {"critic.0", "critic.1", "critic_target.0", "critic_target.1"} <= networks


def test_the_expert_runs_on_the_source_and_not_on_the_target():
    expert = load_expert("cheetah-front-leg")
    source, target = evaluate(expert, "cheetah-front-leg", [0.0, 1.0], episodes=4, seed=5).mean(1)
    assert abs(source - expert.card.episode_return) < 20
    assert target < 40


def test_an_expert_acts_without_torch():
    code = (
        "import sys; sys.modules['torch'] = None; sys.modules['stable_baselines3'] = None\n"
        "import numpy as np, revolver_lab as rvl\n"
        "print(rvl.load_expert('cheetah-front-leg')(np.zeros(18)).shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "(6,)"


def test_an_expert_that_is_not_shipped_or_known_is_refused():
    with pytest.raises(PolicyFileError, match="cheetah-front-leg"):
        load_expert("humanoid-length-mass")
    with pytest.raises(UnknownNameError, match="cheetah-front-leg"):
        load_expert("cheetah-front-legs")
    with pytest.raises(SettingsError, match="no recipe"):
        train_expert("humanoid-length-mass")


def test_recipes_end_on_the_reward_of_the_transfer():
    for name, stages in RECIPES.items():
        assert not stages or stages[-1].task == registry.get(name).usual_task


@pytest.mark.slow
def test_training_an_expert_writes_policy_card_and_curve(tmp_path):
    small = dataclasses.replace(COURSE, hidden=(8,), simulations=2, learning_starts=100)
    stages = (
        Stage(task="dense", steps=800, learner=small),
        Stage(task="sparse", steps=400, learner=small),
    )
    expert = train_expert("cheetah-front-leg", stages=stages, out=tmp_path)
    assert expert.card.steps == 1200
    assert Policy.load(tmp_path / "cheetah-front-leg.safetensors").card == expert.card
    curve = (tmp_path / "cheetah-front-leg.csv").read_text().splitlines()
    assert [line.split(",")[:2] for line in curve[1:]] == [["dense", "800"], ["sparse", "1200"]]
