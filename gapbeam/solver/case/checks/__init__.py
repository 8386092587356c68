"""Contradictions between the tables of a case, and warnings."""
