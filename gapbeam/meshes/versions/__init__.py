"""What differs between releases of DOLFINx, PETSc and MPI: the only room that asks which of them there is."""
