"""The status of a run that is over, from its tables."""

from pathlib import Path

from revolver_lab.runs import store
from revolver_lab.runs.status import LearnerStatus, Status
from revolver_lab.runs.tables import read_results


def ended(folder: Path) -> Status:
    """Returns the status of a finished run.

    Args:
        folder: The run's.

    Raises:
        SettingsError: If a file of it is torn.
    """
    learners = tuple(LearnerStatus(
        method=one.method, seed=one.seed, alpha=one.phases[-1]["alpha"],
        phase=len(one.phases) - 1, phases=len(one.phases), steps=one.cost.steps,
        episode_return=one.phases[-1]["episode_return"],
        evaluations=tuple(zip(one.steps.tolist(), one.curve.tolist())), over=True,
        failure=one.failure,
    ) for one in read_results(folder).learners)  # fmt: skip
    plan, card = store.read_plan(folder), store.read_card(folder)
    planned = plan.steps * len(plan.members)
    broken = [f"{one.method}-{one.seed} was stopped: {one.failure}." for one in learners
              if one.failure]  # fmt: skip
    return Status(state="finished", learners=learners, steps=planned, steps_planned=planned,
                  seconds=float(card["wall_time"]), message=" ".join(broken))  # fmt: skip
