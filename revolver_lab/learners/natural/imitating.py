"""What DAPG and SOIL share: a teacher's pairs, and how much they count."""

import numpy as np

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.learners.natural.actor import Rows
from revolver_lab.learners.natural.npg import NPG
from revolver_lab.learners.natural.settings import PILOT, NaturalSettings
from revolver_lab.trajectories import Trajectories

_LEAST = 1e-30  # of a weight that moves the policy alone: float32 begins to lose smaller ones


def imitation_weight(settings: NaturalSettings, iteration: int, advantages: np.ndarray) -> float:
    """Returns lambda_0 lambda_1^k max A (Rajeswaran et al. 2018, equation 4).

    Where nothing was earned the advantages are all 0; the maximum is then taken as 1, so that
    demonstrations alone move the policy. How far does not depend on their weight, as the step is
    normalised: it then stays above what can be computed with.

    Args:
        settings: lambda_0 and lambda_1.
        iteration: k, from 0.
        advantages: Whitened, (N,).

    Example:
        >>> imitation_weight(NaturalSettings(imitation_weight=0.5), 1, np.array([-1.0, 2.0]))
        0.95
    """
    weight = settings.imitation_weight * settings.imitation_decay**iteration
    if advantages.any():
        return weight * float(advantages.max())
    imitates = settings.imitation_weight > 0 and (settings.imitation_decay > 0 or iteration == 0)
    return max(weight, _LEAST) if imitates else 0.0


class Imitator(NPG):
    """Natural policy gradient with a teacher; without one it is NPG, bit for bit.

    Args:
        observation_size: O.
        action_size: A.
        settings: What it is made of.
        demonstrations: Of the teacher; None for none.
        seed: Seed of weights, actions and minibatches.

    Raises:
        DemonstrationsError: If the demonstrations do not fit the robot.
    """

    def __init__(
        self, observation_size: int, action_size: int, settings: NaturalSettings = PILOT, *,
        demonstrations: Demonstrations | None = None, seed: int = 0,
    ):  # fmt: skip
        super().__init__(observation_size, action_size, settings, seed=seed)
        if demonstrations is not None:
            self.require(demonstrations)
        self.demonstrations = demonstrations
        self.prepare()

    def prepare(self) -> None:
        """Makes what teaching needs, once: a hook; nothing is needed here."""

    def require(self, teacher: Demonstrations) -> None:
        """Raises DemonstrationsError unless states and actions are the robot's."""
        teacher.fits(self.actor.sizes[0], self.actor.sizes[-1])

    def imitated(self, batch: Trajectories, advantages: np.ndarray) -> Rows | None:
        """Returns the teacher's states with what is taught there, at this iteration's weight."""
        weight = imitation_weight(self.settings, self.iterations, advantages)
        if self.demonstrations is None or weight == 0:
            return None
        actions = self.taught(batch, self.demonstrations)
        return Rows(observations=self.demonstrations.observations, actions=actions,
                    weights=np.full(len(actions), weight))  # fmt: skip

    def taught(self, batch: Trajectories, teacher: Demonstrations) -> np.ndarray:
        """Returns the action to imitate in each of the teacher's states, (N, A): the hook.

        Args:
            batch: The policy's own, of this iteration.
            teacher: The demonstrations.
        """
        raise NotImplementedError
