"""Draw a results folder, without a film; print which heavy modules that loads."""

from __future__ import annotations

import sys

from gapbeam.interface.shown_results import render

render(sys.argv[1], film=False, size=(800, 450))
print([name for name in ("dolfinx", "mpi4py", "numba", "pyvista", "scipy", "vtkmodules") if name in sys.modules])
