"""Reduced bases kept on disk, in files that are named after everything a basis depends on.

Modes and static responses take most of the set-up of a large reduced model. They follow from M, K, the contact rows,
the rows of loads and the settings. The name of a file is a hash of these, of M x and K x for two pseudo-random vectors
x instead of the matrices, of the sources of this package and of the versions of the libraries. Another mesh, material,
position of a support or release gives another name; another clearance, law, damping or frequency does not. A basis that
is read has the bits of the one that was found.

Files are in $XDG_CACHE_HOME/gapbeam/bases (~/.cache/gapbeam/bases). Those that were used longest ago are removed when
all of them fill more than a share of the disk. GAPBEAM_KEEP=none keeps and reads nothing.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy.sparse import csr_matrix

from gapbeam.solver.jit import cache_home
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.models.reduction.rigid_sections import Neglected

LOG = logging.getLogger("gapbeam")
LIBRARIES = ("numpy", "scipy", "petsc4py", "slepc4py")
SHARE = 0.1  # of the room on the disk that is free or taken by bases
WORTH = 10.0  # times as long as its files take to be written: what a basis that is kept took to be found


@dataclass(frozen=True)
class FoundBasis:
    """A basis of a body that floats, and what was learned as it was found.

    Attributes:
        floating: The basis on this rank.
        modes: Vibration modes in it, rigid ones included.
        highest_mode: The highest of their frequencies, Hz.
        left: The largest error of the modes that round-off left.
        neglected: Static flexibility that the basis neglects.
    """

    floating: Basis
    modes: int
    highest_mode: float
    left: float
    neglected: Neglected


def kept_or_found(comm: MPI.Comm, inputs: Iterable[Any], find: Callable[[], FoundBasis]) -> FoundBasis:
    """Return the basis that an earlier process kept, or find it, and keep it.

    Args:
        comm: All ranks.
        inputs: All that it follows from, on this rank: text, numbers, arrays, sparse matrices.
        find: Finds it. Collective.

    Collective.
    """
    home = None if os.environ.get("GAPBEAM_KEEP") == "none" else cache_home()
    if not comm.allreduce(home is not None, op=MPI.LAND) or home is None:
        return find()
    names = comm.allgather(_digest(inputs))
    file = home / "bases" / f"{_digest((*names, _program()))}-{comm.rank}.npz"
    found = _read(file)
    if comm.allreduce(found is not None, op=MPI.LAND):
        assert found is not None
        LOG.debug("basis: kept by an earlier run in %s", file.parent)
        return found
    clock = time.perf_counter()
    found = find()
    _keep(file, found, time.perf_counter() - clock)
    return found


def images(operators: PetscOperators) -> Iterable[Any]:
    """Yield M x and K x of two pseudo-random vectors: inputs that change when any entry does. Collective."""
    draw = np.random.default_rng(operators.size)
    for x in draw.standard_normal((2, operators.size)):
        yield operators.apply_mass(x)
        yield operators.apply_stiffness(x)


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
    for source in sorted(Path(__file__).parents[2].rglob("*.py")):
        digest.update(source.read_bytes())
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):
            digest.update(f"{name} {version(name)};".encode())
    return digest.hexdigest()


def _read(file: Path) -> FoundBasis | None:
    """Return the basis of a file; None where there is none, or none that can be read."""
    try:
        with np.load(file, allow_pickle=False) as kept:
            columns, squares, numbers = (kept[name] for name in ("columns", "squares", "numbers"))
        os.utime(file)
        modes, highest, left, local, smooth, section = (float(number) for number in numbers)
        neglected = Neglected(local, smooth, None if np.isnan(section) else section)
        return FoundBasis(Basis(columns, squares), int(modes), highest, left, neglected)
    except FileNotFoundError:
        return None
    except Exception:  # it is damaged: a zip file, its arrays or their number
        with suppress(OSError):
            file.unlink()
        return None


def _keep(file: Path, found: FoundBasis, seconds: float) -> None:
    """Write a basis, whole or not at all, where finding it took long and there is room for it."""
    part, basis, neglected = file.with_suffix(f".{os.getpid()}"), found.floating, found.neglected
    section = np.nan if neglected.section is None else neglected.section
    numbers = [found.modes, found.highest_mode, found.left, neglected.local, neglected.smooth, section]
    size = basis.columns.nbytes
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        clock = time.perf_counter()
        others = sorted((one.stat().st_mtime, one.stat().st_size, one) for one in file.parent.iterdir())
        room = SHARE * (shutil.disk_usage(file.parent).free + sum(other[1] for other in others))
        if size > room:
            return
        with part.open("wb") as stream:
            np.savez(stream, columns=basis.columns, squares=basis.squares, numbers=np.array(numbers, dtype=float))
        if seconds < WORTH * (time.perf_counter() - clock):
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
        LOG.debug("basis: not kept in %s (%s)", file.parent, error.strerror or type(error).__name__)
        with suppress(OSError):
            part.unlink(missing_ok=True)
