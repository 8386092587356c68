"""gmsh started silently on rank 0, and ended whatever happens in between."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from mpi4py import MPI

from meshes.errors import MeshError
from meshes.rank_zero import on_rank_zero


@contextlib.contextmanager
def gmsh_session(comm: MPI.Comm) -> Iterator[None]:
    """An empty gmsh model on rank 0 for the duration of the block.

    A session of the caller's own, when gmsh is already initialized, is left as it was.

    Raises:
        MeshError: gmsh's Python module cannot be loaded.

    Collective.
    """
    was_current = on_rank_zero(comm, _start)
    try:
        yield
    finally:
        if comm.rank == 0:
            _end(was_current)


@contextlib.contextmanager
def gmsh_errors(where: str, expected: str) -> Iterator[None]:
    """Turn gmsh's plain exceptions into MeshError; they carry gmsh's last message and nothing else."""
    try:
        yield
    except MeshError:
        raise
    except Exception as error:
        if type(error) is not Exception:
            raise
        message = str(error) or "no message"
        raise MeshError(where, found=f"that gmsh stopped with: {message}", expected=expected) from error


def _start() -> tuple[str, float] | None:
    """Name and verbosity of the caller's own session; None when there was none."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise MeshError(
            "gmsh", found=str(error), expected="gmsh's Python module (Debian: python3-gmsh, PyPI: gmsh)"
        ) from error
    was_current = None
    if gmsh.isInitialized():
        was_current = (gmsh.model.getCurrent(), gmsh.option.getNumber("General.Terminal"))
    else:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("gapbeam")
    return was_current


def _end(was_current: tuple[str, float] | None) -> None:
    import gmsh

    if was_current is None:
        gmsh.finalize()
        return
    gmsh.model.setCurrent("gapbeam")
    gmsh.model.remove()
    gmsh.model.setCurrent(was_current[0])
    gmsh.option.setNumber("General.Terminal", was_current[1])
