"""Geometry: gmsh on rank 0, a tagged DOLFINx mesh on all ranks; knows no mechanics."""
