"""Print the version of a DOLFINx that gapbeam can use; exit with 1 where there is none."""

import dolfinx
import mpi4py  # noqa: F401
import numpy
import slepc4py  # noqa: F401
from petsc4py import PETSc

release = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
if release < (0, 9) or numpy.dtype(PETSc.ScalarType).kind == "c":
    raise SystemExit(1)
print(dolfinx.__version__)
