"""Lessons as notebooks meet them: watched where they are trained, drawn where they are recorded."""

import numpy as np

from revolver_lab.lab.plots import curves
from revolver_lab.lab.trees import Drawing
from revolver_lab.lab.watch import watch
from revolver_lab.lab.watching import Watching
from revolver_lab.runs import course
from revolver_lab.runs.natural_summary import is_natural, over_iterations


class Lesson(course.Lesson):
    """The rows of a notebook, which can be looked at in every mode."""

    def watch(self) -> Watching | Drawing:
        """Shows the rows: live as they learn, or what was recorded of their learning.

        Returns:
            What `rvl.lab.watch` returns where something is trained; otherwise returns on the
            target against steps, with intervals, seeds and cost. Of natural methods it shows the
            success of the episodes that they trained on, against iterations.

        Raises:
            SettingsError: If a row was not recorded.
        """
        if self.run is not None:
            return watch(self.run)
        results = self.results()
        if is_natural(results):
            trained = over_iterations(results, "success", self.methods)
            count = np.arange(trained[self.methods[0]].shape[1])
            return curves(trained, count, cost=results.cost, title=f"{results.robot}, recorded",
                          xlabel="iteration (who has ended stays at the last value)",
                          ylabel="success in training")  # fmt: skip
        steps, _ = results.curve(self.methods[0])
        by_method = {name: results.curve(name)[1] for name in self.methods}
        return curves(by_method, steps, cost=results.cost, title=f"{results.robot}, recorded",
                      ylabel="return on the target, unshaped")  # fmt: skip


def lesson(name: str, mode: str | None = None) -> Lesson:
    """Returns the rows of a notebook, as data and to look at; nothing is trained or read yet.

    Args:
        name: The notebook's file name, such as "04_deterministic_or_randomised".
        mode: "recorded" reads what is shipped and trains nothing; "live" trains the same rows
            here, with fewer seeds; "fast" takes so few steps that returns mean nothing. None
            takes it from the environment variable REVOLVER_LAB_MODE; "recorded" if that is not
            set.

    Raises:
        UnknownNameError: If there is no such lesson.
        SettingsError: If there is no such mode.
        MissingExtraError: If something is to be trained and torch is not installed.

    Example:
        >>> lesson("02_why_direct_transfer_fails", "recorded").methods
        ('scratch', 'direct', 'revolver')
    """
    plain = course.lesson(name, mode)
    return Lesson(name=plain.name, mode=plain.mode)
