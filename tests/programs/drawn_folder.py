"""Draw a results folder, without a film; print which heavy modules that loads."""

from __future__ import annotations

import sys

from gapbeam.interface.drawn_results import render

render(sys.argv[1], film=False, size=(800, 450))
others = {"scipy"} if "dask" in sys.modules else set()  # which xarray loads where it is installed, as it does dask
print(sorted({"dolfinx", "mpi4py", "numba", "pyvista", "scipy", "vtkmodules"} & set(sys.modules) - others))
