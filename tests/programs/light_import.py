"""Import gapbeam and ask for the help of its command; print as JSON which heavy modules each of both loads.

After these two lists: which names of the interface are missing, and the version.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys

import gapbeam

HEAVY = (
    "dask", "distributed", "dolfinx", "gmsh", "h5py", "jinja2", "matplotlib", "meshio", "mpi4py", "numba", "numpy",
    "petsc4py", "PIL", "plotly", "pydantic", "pyvista", "scipy", "slepc4py", "tomllib", "vtkmodules", "xarray",
)  # fmt: skip
OF_COMMANDS = ("asyncio", "click", "importlib.metadata", "multiprocessing", "rich", "typer")  # the library needs none


def loaded(names: tuple[str, ...]) -> list[str]:
    """Return those of some modules that are loaded."""
    return [name for name in names if name in sys.modules]


heavy = loaded(HEAVY + OF_COMMANDS)

from gapbeam.command_line import main  # noqa: E402 - after what the import alone loads

said = io.StringIO()
with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
    main(["--help"])
assert "identify" in said.getvalue()
heavy_help = loaded(HEAVY)

missing = [name for name in dir(gapbeam) if getattr(gapbeam, name) is None]
print(json.dumps([heavy, heavy_help, missing, gapbeam.__version__]))
