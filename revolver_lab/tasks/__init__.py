"""Tasks: observation, reward and ending in words, over arrays with a leading axis of robots."""

from revolver_lab.tasks.base import State, Task

__all__ = ["State", "Task"]
