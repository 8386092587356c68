"""Runs of a case that leave no files: axes, starts, responses, worker processes."""
