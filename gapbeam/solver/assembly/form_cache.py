"""Compiled forms: one process at a time compiles into a cache of its own, and removes what a killed process left.

DOLFINx compiles a form into a shared library in its cache. While that is made others find its C file without the mark
that it is done, and wait ten seconds for the mark; a process that was killed never sets it, so that all later ones give
up. Here forms have a folder of their own in that cache, in which only who holds its lock compiles: a C file without the
mark is then one whose maker is gone.
"""

from __future__ import annotations

import fcntl
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from dolfinx import fem
from mpi4py import MPI

from gapbeam.meshes.versions.form_compiler import cache_of_dolfinx, compile_here, half_made
from gapbeam.solver.errors import RunError

LOG = logging.getLogger("gapbeam")
FOLDER = "gapbeam"
LOCK = "lock"


def compiled_form(form: Any) -> fem.Form:
    """Return a UFL form as `fem.form` does, compiled where it is not in the cache.

    Raises:
        RuntimeError: It cannot be compiled.

    Collective on the ranks of its mesh.
    """
    options = {"cache_dir": str(cache_folder())}
    comm: MPI.Comm = form.ufl_domain().ufl_cargo().comm
    if comm.size == 1:
        with _alone_in(cache_folder()):
            return fem.form(form, jit_options=options)
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    try:
        if node.rank == 0:  # one for each cache, where machines have their own
            with _alone_in(cache_folder()):
                compile_here(form, options)
    except RunError:
        raise
    except Exception as error:  # tried again below, and raised on all ranks
        LOG.debug("a form was not compiled: %s", error)
    node.Free()
    return fem.form(form, jit_options=options)


def cache_folder() -> Path:
    """Return the folder of compiled forms."""
    return cache_of_dolfinx() / FOLDER


@contextmanager
def _alone_in(cache: Path) -> Iterator[None]:
    """Hold the lock of the cache, which goes with the process, and clear what others left half made.

    Where there are no locks, or nothing can be written, DOLFINx has to do without.
    """
    place = None
    try:
        with suppress(OSError):
            cache.mkdir(parents=True, exist_ok=True)
            place = os.open(cache / LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)
            fcntl.flock(place, fcntl.LOCK_EX)
            _clear(cache)
        yield
    finally:
        if place is not None:
            os.close(place)


def _clear(cache: Path) -> None:
    """Remove forms whose maker is gone."""
    for paths in half_made(cache):
        LOG.info("a form whose compilation was cut off is compiled anew: %s", paths[0].name.partition(".")[0])
        for path in paths:
            path.unlink(missing_ok=True)
