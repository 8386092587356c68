"""Geometry drawn in gmsh."""
