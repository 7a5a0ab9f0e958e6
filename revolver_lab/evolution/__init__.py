"""Robots as points on a path: matching, theta, and E(alpha)."""
