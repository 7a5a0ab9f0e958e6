"""The vector environment as stable-baselines3's algorithms want it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvStepReturn

from revolver_lab.envs.vector import RobotVectorEnv
from revolver_lab.errors import SettingsError


class Sb3VecEnv(VecEnv):
    """A ``RobotVectorEnv`` behind stable-baselines3's interface; rewards stay unshaped.

    ``infos[i]`` holds "alpha" (of the robot that took this step, also where the next episode has
    already begun), "diverged" and, where an episode ended, "terminal_observation",
    "TimeLimit.truncated" and "episode" {"r": unshaped return, "l": steps}.

    Args:
        env: A vector environment in SAME_STEP mode; reachable as ``env``.

    Raises:
        SettingsError: If it restarts in the next step, which stable-baselines3 does not know.
    """

    def __init__(self, env: RobotVectorEnv):
        mode = env.metadata["autoreset_mode"]
        if mode is not AutoresetMode.SAME_STEP:
            raise SettingsError(
                f"autoreset_mode = {mode.value!r}", "'SameStep'", "Make the environment with it."
            )
        self.env = env
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> np.ndarray:
        """Start an episode in every simulation, from the seed given to ``seed`` if there is one.

        Returns:
            Observations, (n, O) float32.
        """
        observations, infos = self.env.reset(seed=self._seeds[0])
        self.reset_infos = [{"alpha": float(alpha)} for alpha in infos["alpha"]]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions, (n, nu), for ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Take the step: observations, unshaped rewards (float32), dones, infos."""
        alphas = self.env.alphas.copy()
        observations, rewards, terminated, truncated, batched = self.env.step(self._actions)
        dones, diverged = terminated | truncated, batched["diverged"]
        infos: list[dict[str, Any]] = [
            {"alpha": alpha, "diverged": flag, "TimeLimit.truncated": cut}
            for alpha, flag, cut in zip(alphas.tolist(), diverged.tolist(), truncated.tolist())
        ]
        for i in np.flatnonzero(dones):
            final = batched["final_info"]
            infos[i]["diverged"] = bool(final["diverged"][i])
            infos[i]["terminal_observation"] = batched["final_obs"][i]
            episode = final["episode"]
            infos[i]["episode"] = {"r": float(episode["r"][i]), "l": int(episode["l"][i])}
        return observations, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Close the environment underneath."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the environment, once per index: all share it."""
        return [getattr(self.env, attr_name)] * len(self._indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the environment, for all simulations."""
        setattr(self.env, attr_name, value)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Call a method of the environment once; return its result once per index."""
        result = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [result] * len(self._indices(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """Return whether simulations are wrapped, which they never are.

        stable-baselines3 asks for its Monitor; episode returns are in the infos without it.
        """
        return [False] * len(self._indices(indices))

    def _indices(self, indices: VecEnvIndices) -> Sequence[int]:
        return list(self._get_indices(indices))
