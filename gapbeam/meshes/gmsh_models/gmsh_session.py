"""gmsh started silently on rank 0, and ended whatever happens in between."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

from mpi4py import MPI

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.meshes.mesh_errors import MeshError

OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.Algorithm": 6,  # frontal Delaunay
    "Mesh.Algorithm3D": 1,  # Delaunay
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.RandomSeed": 1,
}
"""gmsh's options while gapbeam uses it: silent, sizes from the size callback only, reproducible."""

LIBRARIES = (
    "libglu1-mesa libgl1 libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 "
    "libfontconfig1 libxinerama1 libx11-6 libgomp1"
)
"""Debian's packages of the libraries that PyPI's gmsh is linked to."""

_MODEL = "gapbeam"


@dataclass(frozen=True)
class _Callers:
    """Settings of the caller's own gmsh session."""

    model: str
    options: dict[str, float]


@contextlib.contextmanager
def gmsh_session(comm: MPI.Comm) -> Iterator[None]:
    """An empty gmsh model on rank 0 for the duration of the block.

    If gmsh is already initialized, the caller's model and options come back afterwards.

    Raises:
        MeshError: A library of the system that gmsh needs is missing.

    Collective.
    """
    callers = on_rank_zero(comm, _start)
    try:
        yield
    finally:
        if comm.rank == 0:
            _end(callers)


@contextlib.contextmanager
def gmsh_errors(where: str, expected: str) -> Iterator[None]:
    """Turn gmsh's plain exceptions into MeshError; they carry gmsh's last message and nothing else."""
    try:
        yield
    except Exception as error:
        if type(error) is not Exception:
            raise
        message = str(error) or "no message"
        raise MeshError(where, found=f"that gmsh stopped with: {message}", expected=expected) from error


def _start() -> _Callers | None:
    try:
        import gmsh
    except OSError as error:  # it draws windows, too, which are never opened here
        raise MeshError(
            "gmsh",
            found=str(error),
            expected="the libraries that gmsh is linked to",
            hint=f"Debian: apt-get install {LIBRARIES}; quadrilaterals and hexahedra need no gmsh.",
        ) from error
    callers = None
    if gmsh.isInitialized():
        options = {name: gmsh.option.getNumber(name) for name in OPTIONS}
        callers = _Callers(gmsh.model.getCurrent(), options)
    else:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    for name, value in OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.model.add(_MODEL)
    return callers


def _end(callers: _Callers | None) -> None:
    import gmsh

    if callers is None:
        gmsh.finalize()
        return
    gmsh.model.setCurrent(_MODEL)
    gmsh.model.remove()
    gmsh.model.setCurrent(callers.model)
    for name, value in callers.options.items():
        gmsh.option.setNumber(name, value)
