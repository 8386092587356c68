"""Reduced bodies and bases kept on disk, in files that are named after everything they depend on.

Mesh, matrices, modes and static responses take most of the set-up of a reduced model. A basis follows from M, K, the
contact rows, the rows of loads and the settings; a whole body on one rank from the case without what is cheap to
change, and needs none of the libraries for meshes and matrices when it is read. The name of a file is a hash of these,
of M x and K x for two pseudo-random vectors x instead of the matrices, of the sources of this package and of the
versions of the libraries. Another mesh, material, position of a support or release gives another name; another law,
damping or frequency does not. What is read has the bits of what was found.

Files are in $XDG_CACHE_HOME/gapbeam/bases (~/.cache/gapbeam/bases). Those that were used longest ago are removed when
all of them fill more than a share of the disk. GAPBEAM_KEEP=none keeps and reads nothing.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import shutil
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.compilation.jit import cache_home, sources
from gapbeam.solver.messages.wording import LOG

if TYPE_CHECKING:
    from mpi4py import MPI

Found = TypeVar("Found")
LIBRARIES = ("numpy", "scipy", "petsc4py", "slepc4py", "fenics-dolfinx", "fenics-basix", "dolfinx-solver-real", "gmsh")
SHARE = 0.1  # of the room on the disk that is free or taken by kept files
WORTH = 10.0  # times as long as its files take to be written: what is kept took to be found


def kept_or_found(comm: MPI.Comm, kind: type[Found], inputs: Iterable[Any], find: Callable[[], Found]) -> Found:
    """Return a body or basis that an earlier process kept, or find it, and keep it.

    Args:
        comm: All ranks.
        kind: Type of the object.
        inputs: All that it follows from, on this rank: text, numbers, tables, arrays, sparse matrices.
        find: Finds it. Collective.

    Collective.
    """
    home = None if os.environ.get("GAPBEAM_KEEP") == "none" else cache_home()
    if not all(comm.allgather(home is not None)) or home is None:
        return find()
    names = comm.allgather(_digest(inputs))
    file = home / "bases" / f"{_digest((kind.__name__, *names, _program()))}-{comm.rank}.pickle"
    found = _read(file, kind)
    if all(comm.allgather(found is not None)) and found is not None:
        LOG.debug("%s: kept by an earlier run in %s", kind.__name__, file.parent)
        return found
    clock = time.perf_counter()
    found = find()
    _keep(file, found, time.perf_counter() - clock)
    return found


def _digest(values: Iterable[Any]) -> str:
    """Return a hash of text, numbers, arrays and sparse matrices."""
    digest = hashlib.blake2b(digest_size=16)
    for value in values:
        if isinstance(value, csr_matrix):
            parts: tuple[Any, ...] = (value.data, value.indices, value.indptr)
        elif isinstance(value, np.ndarray):
            parts = (value,)
        else:
            parts = (np.frombuffer(repr(value).encode(), dtype=np.uint8),)
        for part in parts:
            digest.update(f"{part.dtype.str} {part.shape};".encode())
            digest.update(np.ascontiguousarray(part).data)
    return digest.hexdigest()


@cache
def _program() -> str:
    """Return a hash of the sources of this package and of the versions of the libraries."""
    digest = hashlib.blake2b(digest_size=16)
    for text in sources().values():
        digest.update(text)
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            digest.update(f"{name} {version(name)};".encode())
    return digest.hexdigest()


def _read(file: Path, kind: type[Found]) -> Found | None:
    """Return the contents of a file; None where there is none, or none that can be read."""
    try:
        found = pickle.loads(file.read_bytes())
        os.utime(file)
        assert isinstance(found, kind)
    except FileNotFoundError:
        return None
    except Exception:  # it is damaged
        with suppress(OSError):
            file.unlink()
        return None
    return found


def _keep(file: Path, found: object, seconds: float) -> None:
    """Write the result, whole or not at all, where finding it took long and there is room for it."""
    part = file.with_suffix(f".{os.getpid()}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        clock = time.perf_counter()
        others = sorted((one.stat().st_mtime, one.stat().st_size, one) for one in file.parent.iterdir())
        room = SHARE * (shutil.disk_usage(file.parent).free + sum(other[1] for other in others))
        with part.open("wb") as stream:
            pickle.dump(found, stream, pickle.HIGHEST_PROTOCOL)
        size = part.stat().st_size
        if size > room or seconds < WORTH * (time.perf_counter() - clock):
            part.unlink()
            return
        part.replace(file)
        taken = size + sum(other[1] for other in others)
        for _, its_size, other in others:  # the one that was used longest ago comes first
            if taken <= room:
                break
            other.unlink(missing_ok=True)
            taken -= its_size
    except OSError as error:
        LOG.debug("not kept in %s (%s)", file.parent, error.strerror or type(error).__name__)
        with suppress(OSError):
            part.unlink(missing_ok=True)
