"""Reduced bases: vibration modes, residual flexibility, projection."""
