"""Robots as points on a path: matching, theta, and E(alpha)."""

from revolver_lab import _versions

# Before MuJoCo is imported: another version fails in ways that do not say so.
_versions.check()
