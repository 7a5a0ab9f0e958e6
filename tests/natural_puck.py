"""A puck that is pushed into a zone: a task of milliseconds with a goal, for NPG and its kin."""

import numpy as np

from revolver_lab.evolution.evolution import Evolution
from revolver_lab.policies import Policy
from revolver_lab.tasks.base import Task

PUCK = """<mujoco model="puck"><option timestep=".05"/><worldbody>
<body name="puck"><joint name="x" type="slide" axis="1 0 0" damping="{damping}"/>
<geom name="puck" type="sphere" size=".1" mass="{mass}"/></body></worldbody>
<actuator><motor name="old" joint="x" gear="{old}" ctrlrange="-1 1"/>
<motor name="new" joint="x" gear="{new}" ctrlrange="-1 1"/></actuator>
</mujoco>"""
LENGTH = 20


class Reach(Task):
    """One for every step within 0.3 m of the middle; success is to be there for 6 steps."""

    n_substeps, episode_steps, goal_steps = 2, LENGTH, 5
    fails = False

    def bind(self, model):
        super().bind(model)
        self.observation_size = 2

    def observe(self, robot):
        return np.concatenate([robot.qpos, robot.qvel], axis=1)

    def success(self, robot):
        return np.abs(robot.qpos[:, 0]) < 0.3

    def reward(self, robot, before):
        return self.success(robot).astype(float)

    def terminated(self, robot):
        return (np.abs(robot.qpos[:, 0]) > 2.5) & self.fails

    def initial_state(self, model, rng):
        return rng.choice([-1, 1], 1) * rng.uniform(0.7, 1.5, 1), np.zeros(1)


class Failing(Reach):
    """Over where the puck is too far away."""

    fails = True


class Barren(Reach):
    """Never rewarded."""

    def reward(self, robot, before):
        return np.zeros(len(robot.qpos))


def puck(name="puck"):
    """One motor fades as another grows: who only knows the first cannot move the target."""
    return Evolution(PUCK.format(mass=1, old=5, new=0.001, damping=1),
                     PUCK.format(mass=1, old=0.001, new=5, damping=1), name=name)  # fmt: skip


def feedback(gains, log_std=-1.0):
    """a = gains . s for the first motor, 0 for the second."""
    weights = {
        "actor.0.weight": np.array([gains, [0, 0]], np.float32),
        "actor.0.bias": np.zeros(2, np.float32),
        "actor.log_std": np.full(2, log_std, np.float32),
    }
    return Policy(weights=weights, head="gaussian", activation="tanh")


EXPERT = feedback([-2.0, -1.5])
