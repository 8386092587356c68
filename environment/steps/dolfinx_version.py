"""Print the version of a DOLFINx that gapbeam can use; fail and say why where there is none."""

import dolfinx
import mpi4py  # noqa: F401
import numpy
import slepc4py  # noqa: F401
from petsc4py import PETSc

release = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
if release < (0, 9):
    raise SystemExit(f"DOLFINx {dolfinx.__version__} is too old, 0.9 or later is needed")
if numpy.dtype(PETSc.ScalarType).kind == "c":
    raise SystemExit("its PETSc has complex numbers, real ones are needed")
print(dolfinx.__version__)
