"""Robots: a table per family, and the registry of named evolutions."""

from revolver_lab.robots.registry import get, load, names, register
from revolver_lab.robots.robot import Robot

__all__ = ["Robot", "get", "load", "names", "register"]
