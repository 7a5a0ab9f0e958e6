"""The three natural learners by name."""

from revolver_lab.demonstrations import Demonstrations
from revolver_lab.errors import SettingsError, UnknownNameError
from revolver_lab.given import count_of, require, seed_of
from revolver_lab.learners.natural.dapg import DAPG
from revolver_lab.learners.natural.imitating import Imitator
from revolver_lab.learners.natural.npg import NPG
from revolver_lab.learners.natural.settings import PILOT, NaturalSettings
from revolver_lab.learners.natural.soil import SOIL

IMITATORS: dict[str, type[Imitator]] = {"DAPG": DAPG, "SOIL": SOIL}
ALGORITHMS = ("NPG", *IMITATORS)


def make_learner(
    algorithm: str, observation_size: int, action_size: int, settings: NaturalSettings = PILOT, *,
    demonstrations: Demonstrations | None = None, seed: int = 0,
) -> NPG:  # fmt: skip
    """Makes a learner.

    Args:
        algorithm: "NPG", "DAPG" or "SOIL".
        observation_size: O.
        action_size: A.
        settings: What it is made of.
        demonstrations: What a teacher did, for DAPG, or saw, for SOIL.
        seed: Seed of weights, actions and minibatches.

    Raises:
        UnknownNameError: If there is no such algorithm.
        SettingsError: If demonstrations are missing, or NPG is given some; or if a size, the seed
            or the settings cannot be.
        DemonstrationsError: If they do not fit the robot.
    """
    if algorithm not in ALGORITHMS:
        raise UnknownNameError(f"algorithm {algorithm!r}", ", ".join(ALGORITHMS), "Take NPG.")
    require("settings", settings, NaturalSettings, "Leave it out.")
    require("demonstrations", demonstrations, (Demonstrations, type(None)),
            "Pass Demonstrations.load(path).")  # fmt: skip
    for name, size in (("observation_size", observation_size), ("action_size", action_size)):
        count_of(name, size, 1, "See env.single_observation_space and env.single_action_space.")
    seed = seed_of(seed)
    if (demonstrations is not None) != (algorithm in IMITATORS):
        given = "without demonstrations" if demonstrations is None else "with demonstrations"
        raise SettingsError(f"{algorithm} {given}", f"demonstrations for {sorted(IMITATORS)}, none "
                            "for NPG", "Record some with `revolver-lab record`.")  # fmt: skip
    if algorithm in IMITATORS:
        return IMITATORS[algorithm](observation_size, action_size, settings,
                                    demonstrations=demonstrations, seed=seed)  # fmt: skip
    return NPG(observation_size, action_size, settings, seed=seed)
