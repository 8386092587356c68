"""Finders of packages: advice where an extra is not installed, the order in which libraries load, and late ones."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import LazyLoader
from types import ModuleType

MESHED = ("mpi4py", "dolfinx", "petsc4py", "slepc4py", "basix", "ufl", "gmsh")
EXTRAS = (
    dict.fromkeys(MESHED, "fem")
    | dict.fromkeys(("matplotlib", "mpl_toolkits", "PIL", "xarray", "h5netcdf"), "analysis")
    | dict.fromkeys(("pyvista", "vtkmodules", "plotly"), "pictures")
    | dict.fromkeys(("distributed", "dask_jobqueue"), "workers")
    | {"emcee": "samples"}
)
"""Extra of each package that gapbeam runs without, where nothing needs it."""
PART_OF = {"basix": "dolfinx", "ufl": "dolfinx", "mpl_toolkits": "matplotlib", "PIL": "pillow"}
WITHOUT_FEM = 'cases with model.type = "beam" or "rigid", files with [[structure]] and scenes'
OF_WHEEL = "dolfinx_solver"  # DOLFINx, petsc4py and slepc4py from PyPI
ON_MPI = ("dolfinx", "petsc4py", "slepc4py", OF_WHEEL)
LATE = ("numpy.f2py", "numpy.testing", "pydoc", "yaml")  # scipy and numba import them, and no run uses them


class MissingExtraError(ModuleNotFoundError):
    """A package of an extra is not installed."""

    exit_status = 2


class _Advice:
    """Last finder of modules: nobody has found the package."""

    @staticmethod
    def find_spec(name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None) -> None:
        """Refuse a package of an extra to imports by gapbeam; let other importers find that it is missing.

        Raises:
            MissingExtraError: The package is not installed.
        """
        extra = EXTRAS.get(name)
        if extra is not None and _importer().startswith("gapbeam."):
            also = f"; {WITHOUT_FEM} need no extra" if extra == "fem" else ""
            package, install = PART_OF.get(name, name), f"pip install 'gapbeam[{extra}]'"
            raise MissingExtraError(
                f"{package} is not installed; it comes with the extra `{extra}`: {install}{also}", name=name
            )


class _Order:
    """First finder of modules: h5py and MPI before the DOLFINx of PyPI, which brings an HDF5 and expects an MPI."""

    @staticmethod
    def find_spec(name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None) -> None:
        """Load h5py and MPI before the first module that stands on them; leave the finding to other finders."""
        if name in ON_MPI and _Order in sys.meta_path:
            sys.meta_path.remove(_Order)
            if PathFinder.find_spec(OF_WHEEL) is not None:
                import h5py  # noqa: F401
                from mpi4py import MPI  # noqa: F401


class _Late:
    """Second finder of modules: some load on first use, not when they are imported."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None) -> ModuleSpec | None:
        """Find a module of `LATE`; leave others to other finders."""
        spec = PathFinder.find_spec(name, path) if name in LATE else None
        if spec is not None and spec.loader is not None:
            spec.loader = LazyLoader(spec.loader)
        return spec


def find_extra_packages() -> None:
    """Put the finders in place."""
    if _Advice not in sys.meta_path:
        sys.meta_path[:0] = [_Order, _Late]
        sys.meta_path.append(_Advice)


def _importer() -> str:
    """Return the name of the module that imports."""
    frame = sys._getframe(2)
    while frame is not None and "importlib" in frame.f_globals.get("__name__", ""):
        frame = frame.f_back  # type: ignore[assignment]
    return "" if frame is None else str(frame.f_globals.get("__name__", ""))
