"""DAPG: demonstrations' log-likelihood gradient on top of the natural policy gradient."""

import numpy as np

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.learners.natural.imitating import Imitator
from revolver_lab.trajectories import Trajectories


class DAPG(Imitator):
    """Demonstration-augmented policy gradient (Rajeswaran et al. 2018).

    What the teacher did is imitated as it is.
    """

    def taught(self, batch: Trajectories, teacher: Demonstrations) -> np.ndarray:
        """Returns what the teacher did, (N, A)."""
        return teacher.actions
