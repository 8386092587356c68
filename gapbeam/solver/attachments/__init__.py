"""Joints and masses on the beam: their tables, and what they add to its equations."""
