"""What seeds say and what they do not: intervals, comparisons, survival curves, and costs."""

from revolver_lab.stats.aggregates import STATISTICS, iqm, optimality_gap
from revolver_lab.stats.bootstrap import Band, Interval, band, interval, performance_profile
from revolver_lab.stats.comparing import Paired, paired, probability_of_improvement
from revolver_lab.stats.cost import Cost
from revolver_lab.stats.successes import success
from revolver_lab.stats.survival import RestrictedMean, Survival, kaplan_meier, restricted_mean
from revolver_lab.stats.thresholds import Times, time_to_threshold

__all__ = [
    "STATISTICS",
    "Band",
    "Cost",
    "Interval",
    "Paired",
    "RestrictedMean",
    "Survival",
    "Times",
    "band",
    "interval",
    "iqm",
    "kaplan_meier",
    "optimality_gap",
    "paired",
    "performance_profile",
    "probability_of_improvement",
    "restricted_mean",
    "success",
    "time_to_threshold",
]
