"""Natural policy gradient: one batch of trajectories, one step of a known size, one value fit."""

import dataclasses
import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np

from revolver_lab.cards import ModelCard
from revolver_lab.learners.natural import gaussian, networks
from revolver_lab.learners.natural.actor import Actor, Rows
from revolver_lab.learners.natural.advantages import gae, whitened
from revolver_lab.learners.natural.settings import PILOT, NaturalSettings
from revolver_lab.learners.natural.steps import conjugate_gradient, natural_step
from revolver_lab.learners.natural.value import Value
from revolver_lab.policies import Policy
from revolver_lab.trajectories import Success, Trajectories, sample

if TYPE_CHECKING:
    from revolver_lab.envs.core import DrawAlpha
    from revolver_lab.envs.vector import RobotVectorEnv


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class IterationReport:
    """What an iteration came to.

    Attributes:
        returns: Unshaped return of each trajectory, as trained, (n,).
        successes: Which of them succeeded, (n,) bool.
        betas: Their robots, (n,).
        steps: Environment steps, those of the value net's first fit included [steps].
        kl: KL divergence of the update, measured on the batch; 0 where nothing was learnt.
        log_std: Mean of log_std after the update.
        explained: Share of the returns' variance that the value net foresaw, before its fit.
        sampling_seconds: Time spent in sampling [s].
        learning_seconds: Time spent in learning [s].
        finite: Whether the update was finite; the policy stays as it was where it was not.
    """

    returns: np.ndarray
    successes: np.ndarray
    betas: np.ndarray
    steps: int
    kl: float
    log_std: float
    explained: float
    sampling_seconds: float
    learning_seconds: float
    finite: bool

    @property
    def success(self) -> float:
        """Returns the fraction that succeeded."""
        return float(self.successes.mean())


class NPG:
    """Natural policy gradient (Kakade 2001) with a normalised step (Rajeswaran et al. 2017).

    Every trajectory runs on its own robot. The Fisher information is exact, its products are
    written out by hand and the network is small: numpy is faster here than a framework.

    Args:
        observation_size: O.
        action_size: A.
        settings: What it is made of.
        seed: Seed of weights, actions and minibatches.
    """

    def __init__(
        self, observation_size: int, action_size: int, settings: NaturalSettings = PILOT, *,
        seed: int = 0,
    ):  # fmt: skip
        self.settings = settings
        # One stream for each purpose: what a variant draws besides leaves the others alone.
        seeds = np.random.SeedSequence(seed).spawn(4)
        self.streams = dict(zip(_STREAMS, map(np.random.default_rng, seeds)))
        sizes = (observation_size, *settings.hidden, action_size)
        network = networks.initial(sizes, self.streams["weights"], last=0.01)
        spread = np.full(action_size, settings.log_std_start, np.float32)
        self.actor = Actor(sizes, np.concatenate([network, spread]))
        self.value = Value(observation_size, settings, self.streams["value"])
        self.iterations = 0

    def adopt(self, policy: Policy) -> None:
        """Takes over a policy with a Gaussian head, its value net not.

        Its noise is changed by `carried_noise`, and kept above the floor.

        Raises:
            PolicyFileError: If it does not fit the robot, or has another head.
        """
        policy.fits(self.actor.sizes[0], self.actor.sizes[-1])
        self.actor = Actor.of(policy, self.settings.log_std_start)
        if self.settings.carried_noise != 1.0:
            self.actor.log_std += np.log(self.settings.carried_noise)
        np.maximum(self.actor.log_std, self.settings.log_std_floor, out=self.actor.log_std)

    def policy(self, card: ModelCard | None = None, *, value: bool = False) -> Policy:
        """Returns a copy of what has been learnt so far.

        Args:
            card: Where it comes from; by default only the algorithm.
            value: Whether the value net travels along, as `value.*`.
        """
        card = card or ModelCard(algorithm=type(self).__name__)
        return self.actor.policy(card, self.value.arrays() if value else {})

    def iterate(
        self, env: "RobotVectorEnv", draw: "DrawAlpha | None" = None, *, shaping: float = 0.0,
        success: Success | None = None,
    ) -> IterationReport:  # fmt: skip
        """Samples a batch, takes a natural step, fits the value net.

        Args:
            env: As many simulations as trajectories, in NextStep mode.
            draw: Draws beta for each trajectory; None keeps what the environment has.
            shaping: h in the paper: rewards count exp(h beta) as much.
            success: When a trajectory succeeds; None is the task's own goal.
        """
        env.draw_alpha = draw if draw is not None else env.draw_alpha
        start = time.perf_counter()
        steps = self._warm(env, shaping)
        batch = self.sample(env)
        sampled = time.perf_counter()
        rewards = batch.rewards * np.exp(shaping * batch.betas)
        values = self.value.predict(batch)
        # The value net's fit and the policy's step share nothing: each has a core to itself.
        with ThreadPoolExecutor(1) as aside:
            fit = aside.submit(self.value.fit, batch, rewards, values, self.settings.value_epochs)
            kl, finite = self._improve(batch, self._advantages(batch, rewards, values))
            explained = fit.result()
        self.iterations += 1
        return IterationReport(
            returns=batch.returns, successes=(success or Success())(env, batch),
            betas=batch.betas, steps=steps + batch.steps, kl=kl, finite=finite,
            log_std=float(self.actor.log_std.mean()), explained=explained,
            sampling_seconds=sampled - start, learning_seconds=time.perf_counter() - sampled,
        )  # fmt: skip

    def sample(self, env: "RobotVectorEnv") -> Trajectories:
        """Plays a batch with actions drawn from the policy."""
        actor, steps = self.actor, min(self.settings.length, env.task.episode_steps)
        shape = (steps, env.num_envs, actor.sizes[-1])
        noise = self.streams["actions"].standard_normal(shape, dtype=np.float32)
        noise *= np.exp(actor.log_std)
        return sample(env, lambda t, seen: actor.mean(seen) + noise[t], steps)

    def _warm(self, env: "RobotVectorEnv", shaping: float) -> int:
        """Fits the value net before the first update; returns the steps that took."""
        if self.value.fitted or not self.settings.warm_batches:
            return 0
        played = [self.sample(env) for _ in range(self.settings.warm_batches)]
        shaped = [batch.rewards * np.exp(shaping * batch.betas) for batch in played]
        self.value.warm(played, shaped)
        return sum(batch.steps for batch in played)

    def _advantages(
        self, batch: Trajectories, rewards: np.ndarray, values: np.ndarray
    ) -> np.ndarray:
        """Returns the whitened advantages of the steps inside, (N,).

        Where nothing was earned there is nothing to tell actions apart by but the value net's
        errors: they are all 0.
        """
        if not rewards.any():
            return np.zeros(batch.steps)
        found = gae(rewards, values, batch.lengths, batch.terminated, gamma=self.settings.gamma,
                    decay=self.settings.gae, bootstrap=self.settings.bootstrap)  # fmt: skip
        return whitened(found[batch.inside])

    def _improve(self, batch: Trajectories, advantages: np.ndarray) -> tuple[float, bool]:
        """Takes the natural step; returns its measured KL and whether it was finite."""
        inside = batch.inside
        observations, actions = batch.observations[:-1][inside], batch.actions[inside]
        weights = advantages / len(advantages)
        gradient = self.actor.gradient(
            Rows(observations=observations, actions=actions, weights=weights)
        )
        imitated = self.imitated(batch, advantages)
        if imitated is not None:
            gradient += self.actor.gradient(imitated) / len(advantages)
        product = self.actor.fisher(observations, self.settings.damping)
        direction = conjugate_gradient(product, gradient, self.settings.cg_iterations)
        moved = self.actor.moved(self._step(gradient, direction), self.settings.log_std_floor)
        if not np.isfinite(gradient).all() or not np.isfinite(moved.flat).all():
            return float("nan"), False
        before, self.actor = self.actor, moved
        apart = gaussian.kl(before.means(observations), before.log_std,
                            moved.means(observations), moved.log_std)  # fmt: skip
        return float(apart.mean()), True

    def _step(self, gradient: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Returns the normalised step; log_std's own where it has one."""
        own = self.settings.noise_step_size
        if own is None:
            return natural_step(gradient, direction, self.settings.step_size)
        network = slice(0, len(gradient) - self.actor.sizes[-1])
        noise = gradient[network.stop :]
        # The Fisher information has no entries between network and log_std, and 2 for the latter.
        return np.concatenate([
            natural_step(gradient[network], direction[network], self.settings.step_size),
            natural_step(noise, noise / 2, own),
        ])  # fmt: skip

    def imitated(self, batch: Trajectories, advantages: np.ndarray) -> Rows | None:
        """Returns pairs whose likelihood is to rise along with the advantages: here, none.

        The hook of DAPG and SOIL. Their gradient is sum_i A_i grad log pi(a_i | s_i) over the
        batch, plus the same sum over these pairs, weights in place of advantages.

        Args:
            batch: The batch of this iteration.
            advantages: Its whitened advantages, (N,).
        """
        return None

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that `restore` needs: arrays by name, and plain values."""
        value, plain = self.value.state()
        arrays = {f"value/{k}": v for k, v in value.items()} | self.actor.arrays()
        streams = {name: rng.bit_generator.state for name, rng in self.streams.items()}
        return arrays, {"iterations": self.iterations, "streams": streams, "value": plain,
                        "activation": self.actor.activation}  # fmt: skip

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned; from there on, nothing is different."""
        weights = {k: v for k, v in arrays.items() if k.startswith("actor.")}
        held = Policy(weights=weights, head="gaussian", activation=plain["activation"])
        self.actor = Actor.of(held, self.settings.log_std_start)
        self.value.restore({k.removeprefix("value/"): v for k, v in arrays.items()
                            if k.startswith("value/")}, plain["value"])  # fmt: skip
        for name, state in plain["streams"].items():
            self.streams[name].bit_generator.state = state
        self.iterations = int(plain["iterations"])


_STREAMS = ("weights", "actions", "value", "inverse")
