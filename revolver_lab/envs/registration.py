"""Every robot's gymnasium id, registered without importing a robot, MuJoCo or an environment."""

from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import register, registry

from revolver_lab.robots.registry import RECORDS

if TYPE_CHECKING:
    from revolver_lab.envs.vector import RobotVectorEnv


def environment_id(name: str) -> str:
    """Return the gymnasium id of a robot.

    Example:
        >>> environment_id("cheetah-front-leg")
        'revolver_lab/CheetahFrontLeg-v0'
    """
    return f"revolver_lab/{''.join(part.capitalize() for part in name.split('-'))}-v0"


def register_environments() -> None:
    """Make ``gymnasium.make`` and ``gymnasium.make_vec`` know every robot; again does nothing.

    gymnasium 1.4 has no entry points that would let it find them by itself. Modules are given by
    name, so nothing of ours is imported before an environment is made.
    """
    for name in RECORDS:
        if environment_id(name) not in registry:
            register(
                environment_id(name),
                entry_point="revolver_lab.envs.single:RobotEnv",
                vector_entry_point="revolver_lab.envs.registration:vector_environment",
                kwargs={"robot": name},
            )


def vector_environment(
    *, num_envs: int, robot: str, alpha: Any = 0.0, task: str | None = None, seed: int | None = None
) -> "RobotVectorEnv":
    """Return what ``gymnasium.make_vec(id, num_envs, ...)`` is to return; see ``make_vec_env``."""
    from revolver_lab.envs.vector import make_vec_env

    return make_vec_env(robot, num_envs, alphas=alpha, task=task, seed=seed)
