"""P learners as Algorithm 1 drives them: they act, remember, forget and improve side by side."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from revolver_lab import shaping
from revolver_lab.cards import ModelCard
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.learners.stacked import naming
from revolver_lab.learners.stacked.algorithm import Algorithm
from revolver_lab.learners.stacked.capture import CapturedUpdate
from revolver_lab.learners.stacked.layout import export, fresh
from revolver_lab.learners.stacked.replay import StackedReplay
from revolver_lab.learners.stacked.sac import SAC
from revolver_lab.learners.stacked.streams import Streams
from revolver_lab.learners.stacked.td3 import TD3
from revolver_lab.methods import Member, Method
from revolver_lab.policies import Policy

ALGORITHMS: dict[str, type[Algorithm]] = {"SAC": SAC, "TD3": TD3}


class StackedLearner:
    """P independent learners of one shape; each draws all that is random from its own streams.

    Args:
        settings: Networks, batch and rates, shared by all.
        observation_size: O.
        action_size: A.
        members: Method and seed of each learner, P of them.
        capacity: Transitions that each replay holds at most.

    Attributes:
        algorithm: The networks and their update.
        replay: The P replays.
        broken: Whose numbers are no longer finite, (P,) bool; such a learner learns no more.
    """

    def __init__(
        self, settings: LearnerSettings, observation_size: int, action_size: int,
        members: Sequence[Member], capacity: int,
    ):  # fmt: skip
        torch.set_num_threads(1)  # two one-thread processes beat one process with two threads
        self.settings, self.members = settings, members
        self.algorithm = ALGORITHMS[settings.name](
            settings, observation_size, action_size, len(members)
        )
        self.replay = StackedReplay(
            len(members), capacity, observation_size, action_size, settings.device
        )
        self.streams = Streams([member.seed for member in members])
        self._update = CapturedUpdate(self.algorithm) if settings.device != "cpu" else None
        self._sizes = observation_size, action_size
        self.adopted, self.started, self.broken = np.zeros((3, len(members)), dtype=bool)
        self.updates, self.alpha = np.zeros(len(members), dtype=int), np.zeros(len(members))
        for p in range(len(members)):
            self._begin(p)

    def _begin(self, p: int) -> None:
        """Draws the first weights of one learner; its targets are copies."""
        rng = self.streams.initial(p)
        for networks in self.algorithm.parts().values():
            arrays = {}
            for twin in range(networks.twins):
                prefix = f"{twin}." if networks.twins > 1 else ""
                drawn = fresh(networks.layout, rng)
                arrays |= {prefix + name: export(name, array) for name, array in drawn.items()}
            for target in (False, True)[: 1 + (networks.target is not None)]:
                networks.write(p, arrays, target=target)
        self.algorithm.begin(p)

    def adopt(self, p: int, expert: Policy) -> None:
        """Takes over an expert's actor, and its critic unless the method resets it."""
        expert.fits(*self._sizes)
        naming.adopt(self.algorithm, p, expert, critic=self.members[p].method.critic == "carried")
        self.adopted[p] = True

    def enter(self, p: int, alpha: float) -> int:
        """Begins a phase of learner p: cleans its replay (line 31), renews Adam if asked.

        Returns:
            Transitions left in its replay.
        """
        method: Method = self.members[p].method
        self.alpha[p] = alpha
        if method.optimiser == "fresh":
            for networks in self.algorithm.parts().values():
                networks.adam.reset(p)
        return self.replay.clean(p, *method.schedule.kept(alpha), method.schedule.latest)

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Draws a ~ pi(. | s) (line 19); uniform until a learner from scratch has begun.

        Args:
            observation: (n, O), the simulations of a learner next to each other.

        Returns:
            Actions in [-1, 1], (n, A) float32.
        """
        learners = len(self.members)
        seen = torch.as_tensor(observation, device=self.settings.device)
        seen = seen.view(learners, -1, self._sizes[0])
        uniform = ~self.adopted & ~self.started
        noise = self.streams.explore(uniform, (seen.shape[1], self._sizes[1]))
        with torch.no_grad():
            drawn = self.algorithm.explore(seen, torch.as_tensor(noise, device=seen.device))
        actions = drawn.cpu().numpy()
        actions[uniform] = noise[uniform]
        return actions.reshape(len(observation), -1)

    def store(
        self, moved: np.ndarray, observation: np.ndarray, action: np.ndarray, reward: np.ndarray,
        following: np.ndarray, terminated: np.ndarray, betas: np.ndarray,
    ) -> None:  # fmt: skip
        """Remembers the transitions of the simulations that moved (line 23), rewards unshaped."""
        owner = np.flatnonzero(moved) // (len(moved) // len(self.members))
        parts = (observation, action, reward, following, terminated, betas)
        self.replay.extend(owner, *(array[moved] for array in parts))

    def update(self, active: np.ndarray) -> None:
        """Trains the active learners on samples of their replays (lines 24 and 25).

        A learner begins once it has seen enough. After that it never waits again: a replay that
        the cleaning has emptied is sampled as soon as it holds anything, for a pause would
        cripple some variants and not others.

        Args:
            active: Whose simulations moved, (P,) bool.
        """
        self.started |= self.replay.size >= self.settings.learning_starts
        for _ in range(self.settings.updates):
            learning = active & self.started & (self.replay.size > 0) & ~self.broken
            if learning.any():
                self._learn(learning)

    def _learn(self, learning: np.ndarray) -> None:
        """One gradient step of the learners in the mask, (P,)."""
        size, device = self.settings.batch_size, self.settings.device
        places, noise = self.streams.batch(learning, self.replay, size, self._sizes[1])
        batch = self.replay.gather(places, self._weights(places, learning), noise)
        self.updates += learning
        due = learning & (self.updates % self.settings.policy_delay == 0)
        masks = [torch.as_tensor(mask[:, None], device=device) for mask in (learning, due)]
        update = self._update or self.algorithm.update
        finite = update(batch, masks[0], masks[1], bool(due.any()))
        self.broken |= learning & ~finite.squeeze(1).cpu().numpy()

    def _weights(self, places: np.ndarray, learning: np.ndarray) -> np.ndarray:
        """Returns what the sampled rewards are multiplied with, (P, B) (line 22, equation 5)."""
        weights = np.ones(places.shape)
        for p in np.flatnonzero(learning).tolist():
            schedule = self.members[p].method.schedule
            if schedule.shaping:
                betas = self.replay.betas[p, places[p]]
                weights[p] = shaping.weight(betas, self.alpha[p], schedule.xi, schedule.shaping,
                                            schedule.shaping_form)  # fmt: skip
        return weights

    def policy(self, p: int, card: ModelCard | None = None) -> Policy:
        """Returns a copy of what learner p has learnt so far, critic included."""
        return naming.policy_of(self.algorithm, p, card)

    def _live(self) -> dict[str, torch.Tensor]:
        """Names every tensor that learning changes, replays apart."""
        found = {f"extra.{name}": array for name, array in self.algorithm.extras().items()}
        for part, networks in self.algorithm.parts().items():
            found |= {f"{part}.{name}": array for name, array in networks.state().items()}
        return found

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns all that a resumed run needs: arrays by name, and plain values."""
        arrays = {name: array.cpu().numpy().copy() for name, array in self._live().items()}
        for p in range(len(self.members)):
            rows, betas = self.replay.dump(p)
            arrays |= {f"replay.{p}.rows": rows.cpu().numpy(), f"replay.{p}.betas": betas}
        flags = {"adopted": self.adopted, "started": self.started, "broken": self.broken,
                 "updates": self.updates, "alpha": self.alpha}  # fmt: skip
        plain = {name: flag.tolist() for name, flag in flags.items()}
        return arrays, plain | {"streams": self.streams.state()}

    def restore(self, arrays: dict[str, np.ndarray], plain: dict[str, Any]) -> None:
        """Puts back what `state` returned."""
        for name, live in self._live().items():
            live.copy_(torch.as_tensor(arrays[name]))
        for p in range(len(self.members)):
            rows = torch.as_tensor(arrays[f"replay.{p}.rows"])
            self.replay.load(p, rows, arrays[f"replay.{p}.betas"])
        for name in ("adopted", "started", "broken", "updates", "alpha"):
            getattr(self, name)[:] = plain[name]
        self.streams.restore(plain["streams"])
