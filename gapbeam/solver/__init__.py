"""Mechanics: from a case file to the motion of the beam."""
