"""Robots: a table per family, and the registry of named evolutions."""

from revolver_lab.robots.registry import Robot, get, load, names

__all__ = ["Robot", "get", "load", "names"]
