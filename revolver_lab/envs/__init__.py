"""Environments: one task, three doors (gymnasium, dm_env, vector), all of the same arithmetic."""
