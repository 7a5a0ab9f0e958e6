"""What people look at: sliders, strips, films, matchings; the only place that needs OpenGL."""

from revolver_lab.lab import plots
from revolver_lab.lab.compare import compare
from revolver_lab.lab.explore import App, explore
from revolver_lab.lab.films import ALPHAS, film, strip
from revolver_lab.lab.lessons import Lesson, lesson
from revolver_lab.lab.pictures import Picture, picture
from revolver_lab.lab.player import Player
from revolver_lab.lab.rollouts import Rollout, record
from revolver_lab.lab.static_slider import static_slider
from revolver_lab.lab.trees import Drawing, show
from revolver_lab.lab.watch import watch
from revolver_lab.lab.watching import Watching

__all__ = [
    "ALPHAS",
    "App",
    "Drawing",
    "Lesson",
    "Picture",
    "Player",
    "Rollout",
    "Watching",
    "compare",
    "explore",
    "film",
    "lesson",
    "picture",
    "plots",
    "record",
    "show",
    "static_slider",
    "strip",
    "watch",
]
