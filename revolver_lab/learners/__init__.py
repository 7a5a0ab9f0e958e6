"""Learners: what turns transitions into a better policy; torch lives only here."""
