"""Loads: a spatial pattern times a function of time."""
