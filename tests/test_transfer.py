"""Algorithm 1 end to end on a problem of milliseconds, against a loop written out by hand."""

import dataclasses
import json

import numpy as np
import pytest
from stable_baselines3 import DQN, SAC

from revolver_lab.algorithm1 import Algorithm1
from revolver_lab.envs.vector import make_vec_env
from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.evaluation import evaluate
from revolver_lab.evolution.evolution import Evolution
from revolver_lab.learners.convert import from_sb3, to_sb3
from revolver_lab.learners.replay import TaggedReplay
from revolver_lab.learners.sb3_env import Sb3VecEnv
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.policies import Policy
from revolver_lab.recorder import Recorder
from revolver_lab.schedule import Adaptive, Schedule
from revolver_lab.tasks.base import Task
from revolver_lab.transferring import transfer

PUCK = """<mujoco model="puck"><option timestep=".02"/><worldbody>
<body name="puck"><joint name="x" type="slide" axis="1 0 0" damping="1"/>
<geom name="puck" type="sphere" size=".1" mass="{mass}"/></body></worldbody>
<actuator><motor name="push" joint="x" gear="{gear}" ctrlrange="-1 1"/></actuator>
</mujoco>"""
LENGTH = 6


class Push(Task):
    """One for every step, so that an unshaped return is exactly the length of the episode."""

    n_substeps, episode_steps = 2, LENGTH

    def bind(self, model):
        super().bind(model)
        self.observation_size = 2

    def observe(self, robot):
        return np.concatenate([robot.qpos, robot.qvel], axis=1)

    def reward(self, robot, before):
        return np.ones(len(robot.qpos))

    def initial_state(self, model, rng):
        return rng.uniform(-1, 1, 1), np.zeros(1)


class PushRight(Push):
    """The velocity, so that a policy can be good or bad."""

    def reward(self, robot, before):
        return robot.qvel[:, 0].copy()


@pytest.fixture(scope="module")
def evolve():
    return Evolution(PUCK.format(mass=1, gear=5), PUCK.format(mass=4, gear=5), name="puck")


TINY = LearnerSettings(hidden=(8,), batch_size=8, simulations=3, learning_starts=6, buffer_size=500)
PATH = Schedule(alpha_step=0.25, xi=0.5, episodes_per_phase=3, shaping=2.0)


class Notebook:
    """A learner that only writes down what the loop does."""

    broken = np.zeros(1, dtype=bool)

    def __init__(self):
        self.events, self.rows = [], []

    def act(self, observation):
        return np.zeros((len(observation), 1))

    def store(self, moved, observation, action, reward, following, terminated, betas):
        if not moved.any():
            return
        assert moved.all()
        self.events.append("store")
        self.rows.append((observation, reward, following, terminated, betas))

    def update(self, active):
        if active.any():
            self.events.append("update")

    def enter(self, p, alpha):
        self.events.append(("enter", p, alpha))
        return 7


def played(evolve, schedule, n=3):
    env = make_vec_env(evolve, n, task=Push(), seed=0, nthread=1, autoreset_mode="NextStep")
    learner, log = Notebook(), Recorder(schedule, LENGTH)
    run(Algorithm1(learner, env, [schedule], [log]))
    return learner, log


def run(loop, seeds=(0,)):
    loop.begin(seeds)
    while not loop.over.all():
        loop.tick()


def test_the_loop_is_the_papers_line_by_line(evolve):
    learner, log = played(evolve, PATH)
    tick = ["store", "update"]
    expected = []
    for alpha in (0.0, 0.25, 0.5, 0.75, 1.0):
        expected += [("enter", 0, alpha), *(tick * LENGTH)]
    assert learner.events == expected
    assert [phase.episodes for phase in log.phases] == [3] * 5
    assert [phase.kept for phase in log.phases] == [7] * 5
    assert log.steps == 5 * 3 * LENGTH


def test_every_phase_draws_its_robots_from_its_own_window(evolve):
    learner, log = played(evolve, PATH)
    betas = np.stack([row[4] for row in learner.rows]).reshape(5, LENGTH, 3)
    for alpha, phase in zip(PATH.alphas, betas):
        assert (phase >= alpha).all()
        assert (phase <= min(alpha + 0.5, 1)).all()
        assert (phase == phase[0]).all()  # one beta an episode
    assert len(np.unique(betas[:4, 0])) == 12
    assert (betas[4] == 1).all()
    assert np.allclose([phase.mean_beta for phase in log.phases], betas[:, 0].mean(axis=1))


def test_no_transition_crosses_the_end_of_an_episode(evolve):
    learner, _ = played(evolve, PATH)
    for k, (first, second) in enumerate(zip(learner.rows, learner.rows[1:])):
        joined = np.array_equal(first[2], second[0])
        assert joined == ((k + 1) % LENGTH != 0)


def test_the_deterministic_variant_runs_alpha_itself(evolve):
    learner, _ = played(evolve, dataclasses.replace(PATH, xi=0.0))
    betas = np.stack([row[4] for row in learner.rows]).reshape(5, -1)
    assert (betas == np.array([[0.0], [0.25], [0.5], [0.75], [1.0]])).all()


def test_the_log_is_unshaped_and_ends_at_exactly_one(evolve, tmp_path):
    log = transfer(None, evolve, PATH, learner=TINY, task=Push(), out=tmp_path, evaluate_episodes=4)
    assert log.returns == (float(LENGTH),) * 5  # exp(2 beta) would show
    assert log.evaluations[-1].returns == (float(LENGTH),) * 4
    assert log.alphas == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert log.reached_target
    assert log.evaluation_steps == 4 * LENGTH
    assert log.policy.card.episode_return == LENGTH
    saved = json.loads((tmp_path / "log.json").read_text())
    assert saved["phases"][-1]["alpha"] == 1.0
    assert saved["settings"]["schedule"]["shaping"] == 2.0
    assert (tmp_path / "phases.csv").read_text().count("\n") == 6
    observation = np.ones((4, 2), np.float32)
    again = Policy.load(tmp_path / "policy.safetensors")
    assert np.array_equal(again(observation), log.policy(observation))


def test_the_same_seed_gives_the_same_policy_and_another_another(evolve):
    first, same, other = (
        transfer(None, evolve, PATH, learner=TINY, task=PushRight(), seed=seed, evaluate_episodes=0)
        for seed in (5, 5, 6)
    )
    assert first.returns == same.returns
    for name, array in first.policy.weights.items():
        assert np.array_equal(array, same.policy.weights[name]), name
    assert first.returns != other.returns


def test_actor_and_critic_are_carried_over(evolve):
    # So small a learning rate that what comes out is what went in.
    still = dataclasses.replace(TINY, learning_rate=1e-12, tau=1e-12)
    expert = transfer(None, evolve, PATH, learner=TINY, task=PushRight(), seed=1).policy
    direct = Schedule(alpha_start=1.0, episodes_per_phase=3)
    carried = transfer(expert, evolve, direct, learner=still, task=PushRight(), seed=2).policy
    for name, array in expert.weights.items():
        assert np.allclose(array, carried.weights[name], atol=1e-6), name


def test_steps_are_spent_to_the_last_in_the_last_phase(evolve):
    log = transfer(None, evolve, PATH, learner=TINY, task=Push(), steps=180, evaluate_every=90)
    assert log.steps == 180
    assert [phase.episodes for phase in log.phases] == [3, 3, 3, 3, 18]
    assert [record.steps for record in log.evaluations] == [90, 180]


def test_adaptive_phases_take_more_episodes_where_the_policy_struggles(evolve):
    class Falling(Push):
        """Worth less the longer one trains, until one has trained for long enough."""

        ticks = 0

        def reward(self, robot, before):
            self.ticks += 1
            good = self.ticks <= 2 * LENGTH or self.ticks > 5 * LENGTH
            return np.full(len(robot.qpos), 1.0 if good else 0.1)

    adaptive = dataclasses.replace(PATH, adaptive=Adaptive(ratio=0.9))
    env = make_vec_env(evolve, 3, task=Falling(), seed=0, nthread=1, autoreset_mode="NextStep")
    log = Recorder(adaptive, LENGTH)
    run(Algorithm1(Notebook(), env, [adaptive], [log]))
    episodes = [phase.episodes for phase in log.phases]
    assert max(episodes) > 3
    assert episodes[0] == episodes[-1] == 3


def test_progress_tells_phase_alpha_return_and_time_left(evolve):
    heard = []
    transfer(None, evolve, PATH, learner=TINY, task=Push(), progress=heard.append,
             evaluate_episodes=0)  # fmt: skip
    assert [(p.phase, p.alpha, p.episode_return) for p in heard] == [
        (k, alpha, LENGTH) for k, alpha in enumerate(PATH.alphas)
    ]
    assert heard[-1].seconds_left == 0
    assert all(p.seconds_left > 0 for p in heard[:-1])


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"schedule": dataclasses.replace(PATH, episodes_per_phase=2)}, "shorter than an episode"),
        ({"steps": 60}, "steps = 60"),
        ({"learner": dataclasses.replace(TINY, algorithm="PPO")}, "algorithm = 'PPO'"),
        ({"learner": dataclasses.replace(TINY, algorithm=DQN)}, "continuous actions"),
        ({"learner": dataclasses.replace(TINY, algorithm=Schedule)}, "algorithm = 'Schedule'"),
        ({"evaluate_episodes": -1}, "episodes = -1"),
    ],
)
def test_what_cannot_work_is_refused_before_the_first_step(evolve, change, text):
    arguments = {"schedule": PATH, "learner": TINY, "task": Push()} | change
    with pytest.raises(SettingsError) as caught:
        transfer(None, evolve, **arguments)
    assert text in str(caught.value)


def test_an_expert_of_another_robot_is_refused(evolve):
    weights = {"actor.0.weight": np.zeros((6, 18)), "actor.0.bias": np.zeros(6)}
    with pytest.raises(PolicyFileError, match="18 observations"):
        transfer(Policy(weights=weights, head="tanh"), evolve, PATH, learner=TINY, task=Push())


@pytest.mark.parametrize(("algorithm", "engine"), [
    ("TD3", "stacked"), ("TD3", "stable-baselines3"), ("DDPG", "auto"),
])  # fmt: skip
def test_other_algorithms_go_through_the_same_loop(evolve, algorithm, engine):
    learner = dataclasses.replace(TINY, algorithm=algorithm, engine=engine)
    log = transfer(None, evolve, PATH, learner=learner, task=Push(), evaluate_episodes=1)
    assert log.policy.head == "tanh"
    assert log.reached_target


def test_evaluation_plays_the_same_starts_on_every_robot(evolve):
    weights = {"actor.0.weight": np.zeros((1, 2)), "actor.0.bias": np.array([9.0])}
    policy = Policy(weights=weights, head="tanh")
    returns = evaluate(policy, evolve, [0.0, 0.0, 1.0], episodes=40, seed=3, task=PushRight())
    assert returns.shape == (3, 40)
    assert np.array_equal(returns[0], returns[1])
    assert (returns[2] < returns[0]).all()  # the same push moves four times the mass less


def test_a_model_of_stable_baselines3_goes_in_and_comes_out(evolve):
    env = Sb3VecEnv(make_vec_env(evolve, 2, task=Push(), alphas=[0.25, 0.5], seed=0))
    theirs = SAC("MlpPolicy", env, replay_buffer_class=TaggedReplay, seed=0, learning_starts=4,
                 batch_size=8, policy_kwargs={"net_arch": [8]}, device="cpu")  # fmt: skip
    theirs.learn(40)
    replay = theirs.replay_buffer
    assert np.unique(replay.betas[: replay.pos]).tolist() == [0.25, 0.5]
    assert not replay.dones.any()  # out of time is no end
    plain = dataclasses.replace(TINY, layer_norm=False)
    log = transfer(from_sb3(theirs), evolve, PATH, learner=plain, task=Push(), evaluate_episodes=0)
    to_sb3(log.policy, theirs)
    observation = np.ones((4, 2), np.float32)
    assert np.allclose(theirs.predict(observation, deterministic=True)[0], log.policy(observation))


def test_a_class_of_ones_own_may_be_passed_in(evolve):
    class Patient(SAC):
        """Counts how often it is trained."""

        calls = 0

        def train(self, gradient_steps, batch_size=64):
            type(self).calls += 1
            super().train(gradient_steps, batch_size)

    learner = dataclasses.replace(TINY, algorithm=Patient)
    assert not learner.stacks
    log = transfer(None, evolve, PATH, learner=learner, task=Push(), evaluate_episodes=0)
    assert Patient.calls == 5 * LENGTH - 1  # from 6 transitions on, never paused
    assert log.policy.card.algorithm == "Patient"


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["stacked", "stable-baselines3"])
@pytest.mark.parametrize("algorithm", ["SAC", "TD3"])
def test_both_engines_learn_to_push_right(evolve, algorithm, engine):
    learner = dataclasses.replace(TINY, hidden=(32, 32), batch_size=32, learning_rate=3e-3,
                                  algorithm=algorithm, engine=engine)  # fmt: skip
    stay = Schedule(alpha_end=0.0, xi=0.0, episodes_per_phase=3)
    before = transfer(None, evolve, stay, learner=learner, task=PushRight(), seed=0)
    after = transfer(None, evolve, stay, learner=learner, task=PushRight(), seed=0, steps=9000)
    assert after.evaluations[-1].mean > before.evaluations[-1].mean + 0.5
    bang = {"actor.0.weight": np.zeros((1, 2)), "actor.0.bias": np.array([9.0])}
    best = evaluate(Policy(weights=bang, head="tanh"), evolve, 0.0, task=PushRight())
    assert after.evaluations[-1].mean > 0.9 * best.mean()
