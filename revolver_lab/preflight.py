"""What is refused before the first step: steps that fall short, memory that is not there."""

from collections.abc import Sequence

from revolver_lab.errors import SettingsError
from revolver_lab.evaluation import MOST_EPISODES
from revolver_lab.given import count_of
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.methods import Member
from revolver_lab.schedule import Schedule

_SHARE = 0.8  # of the free memory: simulations, networks and a checkpoint want the rest


def check_steps(
    steps: int | None, schedule: Schedule, simulations: int, episode_steps: int
) -> None:
    """Refuses a number of steps at which a fixed schedule may not come to its last alpha.

    Args:
        steps: Environment steps of a learner, or None.
        schedule: Its path.
        simulations: Its simulations.
        episode_steps: Steps of an episode that does not end early [steps].

    Raises:
        SettingsError: If they may not do, or are no number of steps.
    """
    if steps is None:
        return
    steps = count_of("steps", steps, 1, "None ends with the schedule.")
    phases = [_steps(schedule, alpha, simulations, episode_steps) for alpha in schedule.alphas[:-1]]
    needed = sum(phases) + simulations * episode_steps
    if steps < needed:
        raise SettingsError(
            f"steps = {steps}", f"{needed} or more, for {len(phases)} phases and the last",
            "Raise the steps or alpha_step, or lower episodes_per_phase.",
        )  # fmt: skip


def check_evaluations(every: int, episodes: int) -> None:
    """Refuses evaluations that cannot be played.

    Args:
        every: Environment steps between them; 0 is only at the end.
        episodes: Of each; 0 plays none.

    Raises:
        SettingsError: If one is no whole number, negative, or beyond what can be played.
    """
    count_of("evaluate_every", every, 0, "0 evaluates at the end only.")
    count_of("evaluate_episodes", episodes, 0, "Ask for 10.", most=MOST_EPISODES)


def _steps(schedule: Schedule, alpha: float, simulations: int, episode_steps: int) -> int:
    """Returns the steps of a phase in which no episode ends early and none is drawn out."""
    if schedule.counts_steps(alpha):
        return schedule.phase_steps or 0
    return -(-schedule.episodes(alpha) // simulations) * simulations * episode_steps


def capacity_of(
    steps: int | None, members: Sequence[Member], settings: LearnerSettings, episode_steps: int
) -> int:
    """Returns how many transitions a replay has to hold at most.

    Args:
        steps: Environment steps of a learner, or None.
        members: The learners.
        settings: Their `buffer_size` is the upper bound.
        episode_steps: Steps of an episode that does not end early [steps].
    """
    if steps is None:
        steps = max(_most_steps(m.method.schedule, settings, episode_steps) for m in members)
    return min(settings.buffer_size, steps + settings.simulations)


def _most_steps(schedule: Schedule, settings: LearnerSettings, episode_steps: int) -> int:
    """Returns an upper bound on the steps of a schedule."""
    limit = schedule.adaptive.episodes_limit if schedule.adaptive else 0
    episodes = sum(max(schedule.episodes(a), limit) + settings.simulations for a in schedule.alphas)
    return max(episodes * episode_steps, (schedule.phase_steps or 0) * len(schedule.alphas))


def check_memory(learners: int, capacity: int, observation_size: int, action_size: int) -> None:
    """Refuses replays that would not fit into the memory that is free now.

    Args:
        learners: P.
        capacity: Transitions that each replay holds at most.
        observation_size: O.
        action_size: A.

    Raises:
        SettingsError: If they would not; it says what would.
    """
    import psutil

    row = replay_bytes(1, 1, observation_size, action_size)
    free = int(_SHARE * psutil.virtual_memory().available)
    if learners * capacity * row > free:
        raise SettingsError(
            f"{learners} replays of {capacity} transitions, {learners * capacity * row / 1e9:.1f} "
            "GB when they are full", f"{free / 1e9:.1f} GB, which is {_SHARE:.0%} of what is free",
            f"Set buffer_size={free // (learners * row)} (the oldest transitions then go first), "
            f"or train {max(free // (capacity * row), 0)} learners at a time.",
        )  # fmt: skip


def replay_bytes(learners: int, capacity: int, observation_size: int, action_size: int) -> int:
    """Returns the memory that replays take when they are full [bytes]: float32, beta float64.

    Example:
        >>> replay_bytes(20, 3_000_000, 143, 12) / 1e9  # Ant-leg-emerge, twenty times: GB
        72.48
    """
    row = 4 * (2 * observation_size + action_size + 2) + 8
    return learners * capacity * row
