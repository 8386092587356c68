"""Findings on the assumptions behind the equations of a run."""
