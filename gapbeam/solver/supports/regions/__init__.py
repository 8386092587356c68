"""Regions that a support leaves to the beam: convex sets of its cross-section plane."""
