"""Runs: a folder each, found again by what was asked for, stopped and resumed at any moment."""

from revolver_lab.runs.keeping import keep
from revolver_lab.runs.plan import Plan
from revolver_lab.runs.recordings import recorded
from revolver_lab.runs.results import LearnerResult, Results
from revolver_lab.runs.run import Run
from revolver_lab.runs.status import LearnerStatus, Status

__all__ = ["LearnerResult", "LearnerStatus", "Plan", "Results", "Run", "Status", "keep", "recorded"]
