"""Differences between releases of DOLFINx, PETSc and MPI: the only package that asks for their versions."""
