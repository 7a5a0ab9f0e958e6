"""Checks of the notebooks' exercises: they say what went wrong, and never give the answer away."""
