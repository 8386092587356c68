"""Out-of-memory errors, whoever raises them: Python, numpy, DOLFINx (std::bad_alloc), PETSc or MUMPS."""

from __future__ import annotations

import errno
import re
import resource
from collections.abc import Iterator
from contextlib import contextmanager

from gapbeam.solver.messages.errors import OutOfMemory

PETSC_OUT_OF_MEMORY = 55
WORDS = re.compile(
    r"bad_alloc|INFOG\(1\)=-(?:5|7|8|9|13|17|20)\b"  # of MUMPS: no room for integers, numbers, a workspace, a buffer
    r"|[Cc]annot allocate memory|failed to map segment"  # of the loader, for kernels of DOLFINx
)
GIGABYTE = 1.0e9


def is_out_of_memory(error: BaseException | None) -> bool:
    """Return whether an error, or one that led to it, says that memory was used up."""
    return any(_says_so(one) for one in chain_of(error))


def _says_so(error: BaseException) -> bool:
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    if type(error).__module__.startswith("petsc4py") and getattr(error, "ierr", 0) == PETSC_OUT_OF_MEMORY:
        return True
    return WORDS.search(str(error)) is not None


def chain_of(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error and the errors that led to it, each once.

    An error that is kept and raised again while its own consequence is handled makes a ring of causes and contexts;
    Python itself breaks only rings of contexts.
    """
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__


@contextmanager
def out_of_memory_reported(doing: str) -> Iterator[None]:
    """Turn errors that say that memory was used up into one that says what to try.

    Args:
        doing: Work meanwhile, in words.

    Raises:
        OutOfMemory: Memory was used up on this rank.
    """
    try:
        yield
    except OutOfMemory:
        raise
    except Exception as error:
        if not is_out_of_memory(error):
            raise
        peak = 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / GIGABYTE
        raise OutOfMemory(
            f"out of memory while {doing} ({type(error).__name__}; this rank had {peak:.3g} GB at most); take a "
            'coarser mesh (mesh.size, mesh.support_size), mesh.degree = 1, mesh.dimension = 2, model.type = "beam", '
            "more machines, or a larger limit of memory; gapbeam check reports what a case needs"
        ) from error
