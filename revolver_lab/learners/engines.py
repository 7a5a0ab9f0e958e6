"""The engine that trains: stacked for many learners at once, or stable-baselines3 for one."""

from collections.abc import Sequence
from typing import Any

from revolver_lab.errors import MissingExtraError, SettingsError
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.methods import Member


def make_engine(
    settings: LearnerSettings, observation_size: int, action_size: int,
    members: Sequence[Member], capacity: int,
) -> Any:  # fmt: skip
    """Makes the learners with the engine that the settings ask for.

    Args:
        settings: The learning algorithm.
        observation_size: O.
        action_size: A.
        members: The learners.
        capacity: Transitions that each replay holds.

    Raises:
        MissingExtraError: If torch is not installed.
        SettingsError: If several are asked of an engine that takes one, or a device that is not
            there.
    """
    sizes = observation_size, action_size
    try:
        if settings.stacks:
            from revolver_lab.learners.stacked.learner import StackedLearner

            _check_device(settings.device)
            return StackedLearner(settings, *sizes, members, capacity)
        from revolver_lab.learners.sb3 import Sb3Learner
    except ImportError as error:
        raise MissingExtraError(
            f"training without {error.name}", "torch and stable-baselines3",
            "Install them: pip install 'revolver-lab[train]'.",
        ) from error  # fmt: skip
    if len(members) > 1:
        raise SettingsError(f"{len(members)} learners with {settings.name} of stable-baselines3",
                            "one learner", "Take SAC or TD3 of the stacked engine.")  # fmt: skip
    return Sb3Learner(settings, *sizes, members[0])


def _check_device(device: str) -> None:
    """Refuses a device that this machine does not have."""
    import torch

    there = torch.cuda.device_count()
    if device != "cpu" and int(device.partition(":")[2] or 0) >= there:
        raise SettingsError(f"device = {device!r} with {there} CUDA devices",
                            "a device that is there", "Take device='cpu'.")  # fmt: skip
