"""Supports of the beam: faces, gaps, area and stiffness."""
