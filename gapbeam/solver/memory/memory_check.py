"""Size of a model before it is made: models that do not fit into memory are refused, and simpler ones are named."""

from __future__ import annotations

import errno
import re
import resource
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, assert_never

from gapbeam.meshes.mesh_size import expected_nodes
from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.assembly.case_mesh import geometry_of, sizing_of
from gapbeam.solver.case.beam_motions import beam_motions
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.periodic_checks import factor_needed
from gapbeam.solver.case.model_choice import chosen_case
from gapbeam.solver.case.solution_tables import AutoModel, BeamModel, FullModel, ReducedModel, RigidModel
from gapbeam.solver.memory.memory_estimate import COPIES, SHAPES, free_memory, memory_needs
from gapbeam.solver.messages.errors import CaseError, OutOfMemory, UserError
from gapbeam.solver.messages.wording import LOG

if TYPE_CHECKING:
    from mpi4py import MPI

GIGABYTE = 1.0e9
SMALL = 0.5 * GIGABYTE  # needs that are not worth asking how much is free
DOFS_OF_ELEMENT = 2  # of each motion of a beam
FAR_MORE = 100.0  # DOFs of a mesh over those of a simpler model: the mesh is then what a run waits for
UNASSEMBLED = 0.25  # of the matrices: what mesh and nodes alone take


def expected_dofs(case: Case) -> float | None:
    """Return the approximate number of DOFs of the mesh of a case; None where a file holds it.

    Raises:
        MeshError: The sizes make no sense.
    """
    if case.mesh.file is not None:
        return None
    return case.mesh.dimension * expected_nodes(geometry_of(case), sizing_of(case), case.mesh.degree)


def simple_dofs(case: Case) -> int:
    """Return the approximate number of DOFs of a model of beam elements, or of a rigid body: one for each motion."""
    motions = len(beam_motions(case))
    return DOFS_OF_ELEMENT * case.model.elements * motions if isinstance(case.model, BeamModel) else motions


def offer_simpler(case: Case) -> None:
    """Name the model that "auto" takes where the mesh of a case, whose set-up or steps take minutes, has far more DOFs.

    A slice is set up in seconds: only where its steps have all of its DOFs does it take minutes.
    """
    flat = case.mesh.dimension == 2
    if case.model.rings is not None or not isinstance(case.model, FullModel if flat else FullModel | ReducedModel):
        return
    with suppress(CaseError):
        simple = chosen_case(case.model_copy(update={"model": AutoModel(type="auto")}))
        dofs, own = expected_dofs(case), simple_dofs(simple)
        if isinstance(simple.model, BeamModel | RigidModel) and dofs and dofs > FAR_MORE * own:
            kind = "beam elements" if isinstance(simple.model, BeamModel) else "a rigid body"
            mesh = "slice" if flat else "solid"
            LOG.info("the %s has about %.2g DOFs; --set model=auto would take %s, with %d", mesh, dofs, kind, own)


def memory_of(case: Case, dofs: float) -> dict[str, float]:
    """Return the approximate memory of a case over all ranks on a mesh of so many DOFs, by its use; bytes.

    Beam elements need the mesh and their own modes; rigid bodies, and what iterations can take the place of, no factor.
    """
    needs = memory_needs(dofs, case.mesh.dimension)
    parts = {"mesh": UNASSEMBLED * needs.matrices}
    if isinstance(case.model, BeamModel):
        own = simple_dofs(case)  # the shapes of a basis, of at most as many columns
        parts["beam"] = 8.0 * COPIES * own * min(own, SHAPES)
        return parts
    parts["matrices"] = needs.matrices - parts["mesh"]
    if isinstance(case.model, RigidModel):
        return parts
    if not isinstance(case.model, FullModel | ReducedModel | AutoModel):  # auto: as the largest that it may become
        assert_never(case.model)
    needed = factor_needed(case.model, case.support, case.contact, case.time, case.analysis)
    if case.solver.effective == "factor" or needed is not None:
        parts["factor"] = needs.factor
    else:
        parts["factor or preconditioner"] = min(needs.factor, needs.preconditioner)
    return parts


def refuse_too_large_before_meshing(case: Case, comm: MPI.Comm, mesh_alone: bool = False) -> None:
    """Refuse a case whose mesh, not made yet, makes a model that the memory has no room for.

    Args:
        case: The case.
        comm: Its ranks.
        mesh_alone: Whether there only needs to be room for the mesh.

    Raises:
        MeshError: The sizes make no sense.
        UserError: There is no room, and `gates.accept_lack_of_memory` is not set.

    Collective.
    """
    dofs = on_rank_zero(comm, lambda: expected_dofs(case))
    if dofs is not None:
        refuse_too_large(case, dofs, comm, mesh_alone)


def refuse_too_large(case: Case, dofs: float, comm: MPI.Comm, mesh_alone: bool = False) -> None:
    """Refuse a model that the memory has no room for: that of all machines of its ranks, within their control groups.

    Args:
        case: The case.
        dofs: DOFs of its mesh, about.
        comm: Its ranks.
        mesh_alone: Whether there only needs to be room for the mesh.

    Raises:
        UserError: There is no room, and `gates.accept_lack_of_memory` is not set.

    Collective.
    """
    fault = lack_of_memory(case, dofs, comm, mesh_alone)
    if fault is None:
        return
    if not case.gates.accept_lack_of_memory:
        raise UserError(
            f"{fault}. Try {', '.join(_what_helps(case, dofs))}, or more machines; "
            "gates.accept_lack_of_memory = true runs it anyway"
        )
    if comm.rank == 0:
        LOG.warning("%s; accepted by gates.accept_lack_of_memory = true", fault)


def _what_helps(case: Case, dofs: float) -> Iterator[str]:
    """Yield the changes that make a model smaller, as far as the case has not made them."""
    needs, ours = memory_needs(dofs, case.mesh.dimension), case.mesh.file is None
    yield "a coarser mesh (mesh.size, mesh.support_size)" if ours else "a coarser mesh in mesh.file"
    if case.mesh.degree == 2:
        yield "mesh.degree = 1"
    if ours and case.mesh.dimension == 3:
        yield "mesh.dimension = 2"
    if isinstance(case.model, BeamModel):
        return
    if not isinstance(case.model, RigidModel) and needs.preconditioner < needs.factor:
        needed = factor_needed(case.model, case.support, case.contact, case.time, case.analysis)
        if needed is not None:
            yield f"a case without {needed[1]}, which needs a factor where iterations would do with less"
        elif case.solver.effective == "factor":
            yield 'solver.effective = "iterative"'
    yield 'model.type = "beam"'


def lack_of_memory(case: Case, dofs: float, comm: MPI.Comm, mesh_alone: bool = False) -> str | None:
    """Return the lack of memory of a case on a mesh of so many DOFs, in words; None where there is room. Collective."""
    parts = memory_of(case, dofs)
    needed = parts["mesh"] if mesh_alone else sum(parts.values())
    if needed < SMALL:
        return None
    free = free_memory(comm)
    if needed <= free:
        return None
    words = ", ".join(f"{name} {size / GIGABYTE:.3g}" for name, size in parts.items())
    total = sum(parts.values()) / GIGABYTE
    return (
        f"the model would need about {total:.3g} GB of memory ({dofs:.2g} DOFs; {words} GB), and "
        f"{free / GIGABYTE:.3g} GB are free on the machines of this run, within the limits of its control groups"
    )


PETSC_OUT_OF_MEMORY = 55
WORDS = re.compile(
    r"bad_alloc|INFOG\(1\)=-(?:5|7|8|9|13|17|20)\b"  # of MUMPS: no room for integers, numbers, a workspace, a buffer
    r"|[Cc]annot allocate memory|failed to map segment"  # of the loader, for kernels of DOLFINx
)


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
    """Turn errors of lack of memory into one with advice.

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
