"""What people look at: strips, films, matchings; the only place that needs OpenGL."""

from revolver_lab.lab.films import ALPHAS, film, strip
from revolver_lab.lab.rollouts import Rollout, record
from revolver_lab.lab.trees import Drawing, show

__all__ = ["ALPHAS", "Drawing", "Rollout", "film", "record", "show", "strip"]
