"""The releases of everything that results depend on."""

from __future__ import annotations

import platform
import sys
from importlib import metadata

import numpy as np


def versions() -> dict[str, str]:
    """Return the versions of all packages that results of this process depend on, as far as loaded."""
    found = python_versions()
    if "dolfinx" in sys.modules:
        import dolfinx
        import petsc4py

        found |= {"dolfinx": dolfinx.__version__, "petsc4py": petsc4py.__version__, "gmsh": _installed("gmsh")}
    if "mpi4py.MPI" in sys.modules:
        from mpi4py import MPI

        found["mpi"] = MPI.Get_library_version().split("\n")[0].split(",")[0].strip("\x00 ")
    return found


def all_versions() -> dict[str, str]:
    """Return the versions of everything that results may depend on, and the first package that is lacking."""
    try:
        import dolfinx  # noqa: F401
        from mpi4py import MPI  # noqa: F401
    except ImportError as fault:
        return versions() | {"lacking": str(fault)}
    return versions()


def python_versions() -> dict[str, str]:
    """Return the versions of the packages behind results of scenes, which need no DOLFINx."""
    own = {"gapbeam": _installed("gapbeam"), "python": platform.python_version()}
    return own | {"numpy": np.__version__, "numba": _installed("numba")}


def _installed(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "source tree"
