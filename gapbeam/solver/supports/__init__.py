"""Supports: faces, gaps, area and stiffness of what the beam lies in."""
