"""The class behind the vector door: n robots of n alphas stepped together by ``mujoco.batch``."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from mujoco.batch import Batch, SimulationError

from revolver_lab.envs.core import Controls, DrawAlpha, Purpose, Stage, first_look, judge, stream
from revolver_lab.envs.infos import alphas_of, masked, mode_of, objects, seeds_of
from revolver_lab.envs.memory import return_large_blocks
from revolver_lab.envs.single import spaces_of


class RobotVectorEnv(VectorEnv):
    """n simulations, each with its own robot E(alpha_i), behind gymnasium's vector interface.

    Simulation i equals ``RobotEnv(..., simulation=i)`` reset with the same seed, step for step
    and bit for bit, for any n and any number of threads. A new alpha takes effect when an episode
    of its simulation starts. ``infos`` has "alpha" and "diverged" at every step and "episode"
    (unshaped return "r", steps "l" and, if the task has a goal, "success") where one ended; in
    SAME_STEP mode the ended episode's infos are in "final_info" and "final_obs", exactly as in
    gymnasium's SyncVectorEnv.

    Attributes:
        alphas: Alpha of the running episode of each simulation, (n,); read only.
        held: In how many steps of it the task's goal held, (n,); read only.
        halted: Simulations that stand still: no step, no reward, no new episode, (n,) bool.
        draw_alpha: Draws the alpha of each new episode; None keeps what ``set_alphas`` set.
        batch: The ``mujoco.batch.Batch`` underneath.
        models: The robot of each simulation.
    """

    def __init__(
        self,
        stage: Stage,
        n: int,
        *,
        alphas: float | Sequence[float] | np.ndarray = 0.0,
        draw_alpha: DrawAlpha | None = None,
        seed: int | Sequence[int] | None = None,
        nthread: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    ):
        """Compile one robot per simulation; for the arguments see ``make_vec_env``."""
        self.evolve, self.task, self.camera = stage.evolve, stage.task, stage.camera
        self.num_envs, self.draw_alpha = n, draw_alpha
        self.metadata = {"autoreset_mode": mode_of(autoreset_mode)}
        self.alphas = alphas_of(alphas, n)
        self._next_alphas = self.alphas.copy()
        self.models = [self.evolve.model(alpha) for alpha in self.alphas]
        self._make_batch(nthread)
        self._make_spaces()
        self._last = np.zeros((n, self.task.observation_size), np.float32)
        self._steps, self.held = np.zeros((2, n), dtype=int)
        self._returns = np.zeros(n)
        self._waiting, self.halted = np.zeros((2, n), dtype=bool)
        self._seed(seed)

    def _make_batch(self, nthread: int) -> None:
        """Bind what the task reads, and nothing else: every bound field costs a copy a step."""
        return_large_blocks()
        self.task.bind(self.models[0])
        self.batch = Batch(self.models[0], self.num_envs, nthread)
        self.take_robots()
        self.robot = self.task.state_class({f: self.batch.bind(f) for f in self.task.fields})
        self._qpos, self._qvel = self.batch.bind("qpos"), self.batch.bind("qvel")
        self._mocap_pos, self._warnings = self.batch.bind("mocap_pos"), self.batch.warning[:, :, 1]
        self._ctrl = self.batch.bind("ctrl")
        derived = self.task.needs_derived
        self._stage = int(mujoco.mjtStage.mjSTAGE_ACC if derived else mujoco.mjtStage.mjSTAGE_NONE)

    def _make_spaces(self) -> None:
        observation, action = spaces_of(self.task.observation_size, self.models[0].nu)
        self.single_observation_space, self.single_action_space = observation, action
        self.observation_space = batch_space(observation, self.num_envs)
        self.action_space = batch_space(action, self.num_envs)

    def _seed(self, seed: int | Sequence[int] | None) -> None:
        """Name the random streams of every simulation; None keeps those there are."""
        if seed is None and self._np_random is not None:
            return
        several = isinstance(seed, Sequence | np.ndarray)
        groups = seeds_of([*seed], self.num_envs) if several else [seed]
        super().reset(seed=groups[0])
        groups[0] = int(self.np_random_seed or 0)
        size = self.num_envs // len(groups)
        names = [(base or 0, i) for base in groups for i in range(size)]
        self._starts = [stream(*name, Purpose.START) for name in names]
        self._draws = [stream(*name, Purpose.ALPHA) for name in names]

    def set_alphas(self, alphas: float | Sequence[float] | np.ndarray) -> None:
        """Set the alphas of the episodes to come; those that run go on as they are.

        Args:
            alphas: One for all or (n,), in [0, 1].

        Raises:
            AlphaError: If one is not in [0, 1].
            SettingsError: If there are not n of them.
        """
        self._next_alphas = alphas_of(alphas, self.num_envs)

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode in every simulation.

        Args:
            seed: Restarts all random streams, see ``make_vec_env``; None goes on with them.
            options: {"alpha": one for all or (n,)} as ``set_alphas``.

        Returns:
            Observations, (n, O) float32, and infos.
        """
        self._seed(seed)
        if options and "alpha" in options:
            self.set_alphas(options["alpha"])
        self._begin(np.ones(self.num_envs, dtype=bool))
        self._waiting = np.zeros(self.num_envs, dtype=bool)
        return self._last.copy(), self._infos(np.zeros(self.num_envs, dtype=bool))

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Take one step in every simulation.

        Args:
            actions: (n, nu) in [-1, 1]; what is outside is clipped.

        Returns:
            Observations (n, O) float32, unshaped rewards (n,), terminations (n,),
            truncations (n,), infos.

        Raises:
            SettingsError: If the actions have another shape.
        """
        idle = self._waiting | self.halted
        resting = np.count_nonzero(idle) > 0
        before = self.task.remember(self.robot)
        self._ctrl[:] = self._controls(actions, self._ctrl.shape)
        suspect = self._simulate(np.flatnonzero(~idle) if resting else None)
        self.task.step_seconds = self._step_seconds
        outcome = judge(self.task, self.robot, before, suspect, self._last)
        if resting:
            outcome = outcome.without(idle)
            outcome.observation[self.halted] = self._last[self.halted]
        self._last = outcome.observation
        self._steps += 1
        self.held += outcome.success
        self._returns += outcome.reward
        truncated = self._steps >= self.task.episode_steps
        if resting or np.count_nonzero(truncated):
            truncated &= ~(outcome.terminated | idle)
            self._begin(self._waiting & ~self.halted)
            self._waiting &= self.halted
        infos = self._close_episodes(outcome.terminated | truncated, outcome.diverged)
        return self._last.copy(), outcome.reward, outcome.terminated, truncated, infos

    def _simulate(self, ids: np.ndarray | None) -> np.ndarray:
        """Run the physics; return the simulations that MuJoCo warned about or gave up, (n,)."""
        suspect = np.zeros(self.num_envs, dtype=bool)
        try:
            self.batch.step(ids, self.task.n_substeps, self._stage)
        except SimulationError as error:
            suspect[error.ids] = True
        if np.count_nonzero(self._warnings):
            suspect |= self._warnings.any(axis=1)
            self.batch.warning[:] = 0
        return suspect

    def _close_episodes(self, done: np.ndarray, diverged: np.ndarray) -> dict[str, Any]:
        """Report on the step, and in SAME_STEP mode start anew where an episode is done."""
        if not np.count_nonzero(done):
            return self._infos(diverged)
        episode: dict[str, Any] = {"r": self._returns.copy(), "l": self._steps.copy()}
        if self.task.goal_steps is not None:
            episode["success"] = self.held > self.task.goal_steps
        episode = {"episode": episode}
        if self.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP:
            self._waiting |= done
            return self._infos(diverged) | masked(episode, done)
        info = {"alpha": self.alphas.copy(), "diverged": diverged} | episode
        final = {"final_info": masked(info, done), "_final_info": done.copy()}
        final |= {"final_obs": objects(self._last, done), "_final_obs": done.copy()}
        self._begin(done)
        return self._infos(diverged & ~done) | final

    def _infos(self, diverged: np.ndarray) -> dict[str, Any]:
        everyone = np.ones(self.num_envs, dtype=bool)  # what `masked` says, in every step
        return {"alpha": self.alphas.copy(), "_alpha": everyone,
                "diverged": diverged, "_diverged": everyone.copy()}  # fmt: skip

    def _begin(self, which: np.ndarray) -> None:
        """Start an episode in the simulations of the mask ``which``, (n,)."""
        ids = np.flatnonzero(which)
        if not len(ids):
            return
        self._change_robots(ids)
        self.batch.reset(ids, stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        for i in ids:
            places = self.task.scene(self.models[i], self._starts[i])
            if places is not None:
                self._mocap_pos[i] = places
            start = self.task.initial_state(self.models[i], self._starts[i])
            self._qpos[i], self._qvel[i] = start
        self.batch.forward(ids)
        self.batch.warning[ids] = 0
        self._last[ids] = first_look(self.task, self.robot)[ids]
        self._steps[ids], self.held[ids], self._returns[ids] = 0, 0, 0.0

    def _change_robots(self, ids: np.ndarray) -> None:
        """Give each simulation the robot of its next alpha; who keeps its alpha is left alone."""
        if self.draw_alpha is not None:
            drawn = [self.draw_alpha(int(i), self._draws[i]) for i in ids]
            self._next_alphas[ids] = alphas_of(drawn, len(ids))
        changed = ids[self._next_alphas[ids] != self.alphas[ids]]
        for i in changed:
            self.evolve.write_model(self.models[i], float(self._next_alphas[i]))
        if len(changed):
            self.alphas[changed] = self._next_alphas[changed]
            self.take_robots()

    def take_robots(self) -> None:
        """Step the robots in ``models`` from now on; call it again whenever one has changed."""
        self.batch.set_models(self.models)
        # What is not in their states: what an action means, and how long a step is.
        self._controls = Controls.each(self.models)
        self._step_seconds = self.task.seconds_of(self.models)
