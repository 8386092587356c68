"""Reads results and draws them; runs without DOLFINx and PETSc."""
