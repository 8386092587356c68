"""The releases of everything that results depend on."""

from __future__ import annotations

import platform
from importlib import metadata

import dolfinx
import numpy as np
import petsc4py
from mpi4py import MPI


def versions() -> dict[str, str]:
    """Return the versions of everything that results depend on."""
    own = {"gapbeam": _installed("gapbeam"), "python": platform.python_version()}
    return own | {
        "dolfinx": dolfinx.__version__,
        "petsc4py": petsc4py.__version__,
        "numpy": np.__version__,
        "gmsh": _installed("gmsh"),
        "mpi": MPI.Get_library_version().split("\n")[0].split(",")[0].strip("\x00 "),
    }


def _installed(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "source tree"
