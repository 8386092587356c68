"""Distributed operators of a finite element model: PETSc matrices and their solvers.

What large models would not have room for is made when it is asked for: of M, the same for every component, one block
is kept, and K as it is marched is put together from its parts.

Choice of the linear solver of an effective operator: a factor as long as it fits in memory, iterations beyond.

A factor costs most when it is made and solves in milliseconds; conjugate gradients need a fraction of its memory and
dozens of products for every solve (docs/benchmarks/large-models.md). Between the two lies a factor without the columns
A^-1 G^T: it needs less memory, and a step takes two back-substitutions instead of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix, identity, kron

from gapbeam.solver.assembly.elasticity import ElasticParts, assembled
from gapbeam.solver.case.solution_tables import SolverTable
from gapbeam.solver.linear_algebra.iterative_factor import ConjugateGradients, columns_product
from gapbeam.solver.linear_algebra.mumps_factor import DeflatedFactor
from gapbeam.solver.linear_algebra.smooth_modes import (
    Deflation,
    add_springs,
    as_matrix,
    enlarge_by_springs,
    rigid_body_modes,
    smooth_modes,
)
from gapbeam.solver.linear_algebra.substructured_factor import factor_on_ranks, not_factored
from gapbeam.solver.memory.memory_check import GIGABYTE
from gapbeam.solver.memory.memory_estimate import MemoryNeeds
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array, Factor, Interface, RankOnes, Springs
from gapbeam.solver.system.rank_one_update import updated

OF_SQUARES = 1.0e-3  # of the tolerance, that squares of errors keep to
USED = 0.9  # of the memory that is free: the rest is for what is written and for other processes


@dataclass(frozen=True)
class LinearSolver:
    """Choice of the solver for effective operators.

    Attributes:
        iterative: Whether conjugate gradients solve; otherwise a factor.
        tolerance: Tolerance of conjugate gradients: the error over the solution, in the energy norm of the operator.
        columns_limit: Bytes that the columns A^-1 G^T may take over all ranks; None: no limit.
        reason: Why, in a few words.
    """

    iterative: bool = False
    tolerance: float = 1.0e-9
    columns_limit: float | None = None
    reason: str = "given"

    @property
    def basis_tolerance(self) -> float:
        """Tolerance for vectors of a basis: an error of 1e-6 in them is one of 1e-12 in the energies they span."""
        return max(self.tolerance, sqrt(OF_SQUARES * self.tolerance))


FACTORED = LinearSolver()


def linear_solver(
    settings: SolverTable, needs: MemoryNeeds, free: float, needs_factor: str | None = None
) -> LinearSolver:
    """Return the linear solver of a model.

    Args:
        settings: The table [solver] of the case.
        needs: Memory that the model needs.
        free: Memory that is free over all machines, bytes.
        needs_factor: Part of the case that needs a factor, or None.
    """
    room = settings.memory * GIGABYTE if settings.memory is not None else USED * free
    left = room - needs.matrices - needs.factor
    columns = {"keep": None, "drop": 0.0, "auto": max(left, 0.0)}[settings.columns]
    words = (
        f"a factor of about {needs.factor / GIGABYTE:.2g} GB besides {needs.matrices / GIGABYTE:.2g} GB of mesh and "
        f"matrices, {room / GIGABYTE:.3g} GB may be used"
    )
    if settings.effective == "iterative" or (settings.effective == "auto" and needs_factor is None and left < 0.0):
        reason = "given" if settings.effective == "iterative" else words
        return LinearSolver(True, settings.tolerance, columns, reason)
    reason = "given" if settings.effective == "factor" else words
    if needs_factor is not None and left < 0.0:
        reason += f"; {needs_factor} needs a factor all the same"
    return LinearSolver(False, settings.tolerance, columns, reason)


def mass_matrix(consistent: PETSc.Mat, lumped: bool, extrapolation: PETSc.Mat | None) -> PETSc.Mat:
    """Return the mass matrix that is marched: consistent, lumped and redistributed as asked.

    Lumped masses are the diagonal of the consistent matrix, scaled to its total (Hinton, Rock and Zienkiewicz 1976);
    for affine cells of one kind this is the same cell by cell. Redistributed, they are E^T m.

    Raises:
        UserError: A lumped mass is not positive after redistribution.

    Collective.
    """
    if not lumped:
        return consistent if extrapolation is None else consistent.ptap(extrapolation)
    masses, total, ones = consistent.getDiagonal(), consistent.createVecLeft(), consistent.createVecRight()
    ones.set(1.0)
    consistent.mult(ones, total)
    masses.scale(total.sum() / masses.sum())
    if extrapolation is not None:
        moved = masses.duplicate()
        extrapolation.multTranspose(masses, moved)
        masses = moved
        if masses.min()[1] < 0.0:
            raise UserError(
                'contact.mass = "redistributed" with lumped masses: a mass becomes negative; expected cells of about '
                "equal size below the contact faces; try mesh.support_size and mesh.edge_size nearer to each other"
            )
    first, end = masses.getOwnershipRange()
    pattern = (np.arange(end - first + 1, dtype=PETSc.IntType), np.arange(first, end, dtype=PETSc.IntType))
    return PETSc.Mat().createAIJ(consistent.getSizes(), csr=(*pattern, masses.array_r), comm=consistent.comm)


SHIFTED = "gapbeam_shifted_"  # prefix of PETSc's options for K + sigma M
FEW_DIGITS = (
    1.0e2  # times the round-off of K: a rigid motion of a seat is held by less, and its factor has no digits there
)
FAST = 1.0e7  # c_k K over c_m M, largest entries: beyond, steps are so long that a free flight would cancel in contact


class PetscOperators:
    """M, K and restraint of a finite element model.

    Args:
        parts: Mass, stiffness and restraint, cell by cell.
        space: The vector space they live on.
        correction: Contribution of a contact formulation to K.
        lumped: Make M diagonal.
        extrapolation: E, which moves mass from the contact nodes into the body (`assembly.mass_redistribution`).
        solver: Choice of the solver for effective operators.
        marched: True where a march uses M and K themselves. Products and solves are then exact on the smooth modes,
            whose digits are lost in the round-off of K where the body is slender.

    Attributes:
        solver: As given.
        has_massless: Whether any rank has DOFs without mass.
        smooth: The smooth modes Z and K Z, where M and K are marched and factored; else None.

    Raises:
        UserError: A lumped mass is not positive.

    Collective to make and to use.
    """

    def __init__(
        self,
        parts: ElasticParts,
        space: fem.FunctionSpace,
        correction: Springs | None = None,
        lumped: bool = False,
        extrapolation: PETSc.Mat | None = None,
        solver: LinearSolver = FACTORED,
        marched: bool = False,
    ) -> None:
        self.solver = solver
        self._comm, self._space = space.mesh.comm, space
        mass = mass_matrix(assembled(parts.mass), lumped, extrapolation)
        diagonal = np.array(mass.getDiagonal().array_r)
        self.massless = diagonal == 0.0
        self.has_massless = bool(self._comm.allreduce(np.any(self.massless), op=MPI.LOR))
        self._restraint = assembled(parts.restraint)
        self._springs = self._restraint  # and what holds sections
        self._elastic = assembled(parts.stiffness)
        if correction is not None:
            add_springs(self._elastic, correction, self.sum)
        pattern = PETSc.Mat.Structure
        # mass that was moved into the body couples DOFs of different cells
        self._springs_pattern = pattern.SUBSET_NONZERO_PATTERN
        self._mass_pattern = (
            pattern.SUBSET_NONZERO_PATTERN if extrapolation is None else pattern.DIFFERENT_NONZERO_PATTERN
        )
        self._rigid = rigid_body_modes(space)
        self._components = space.dofmap.index_map_bs
        self.size = mass.getLocalSize()[0]
        # Every component has the same mass matrix: a product with it, of all components at once, reads a ninth (3D).
        first, _ = mass.getOwnershipRange()
        rows = PETSc.IS().createStride(self.size // self._components, first, self._components, comm=self._comm)
        self._component_mass = mass.createSubMatrix(rows, rows)
        mass.destroy()
        nodes = self._component_mass.getSizes()[1]
        self._components_in = PETSc.Mat().createDense((nodes, (PETSc.DECIDE, self._components)), comm=self._comm)
        self._components_in.setUp()
        self._components_in.assemble()
        self._components_out = self._component_mass.matMult(self._components_in)
        self._vector_in, self._vector_out = self._elastic.createVecs()
        self._stiffness_diagonal = np.array(self._elastic.getDiagonal().array_r + self._restraint.getDiagonal().array_r)
        self._stiffest = self._comm.allreduce(float(np.max(self._stiffness_diagonal, initial=0.0)), op=MPI.MAX)
        self._fastest = self._stiffest / self._component_mass.getDiagonal().max()[1]
        self.smooth = smooth_modes(space, self._elastic, self.sum) if marched and not solver.iterative else None

    def hold(self, springs: RankOnes | None, restraint: RankOnes | None = None) -> None:
        """Add stiff springs to K, and to the restraint; they may couple DOFs of different cells. Collective."""
        if restraint is not None:
            enlarge_by_springs(self._restraint, self.as_springs(restraint), self.sum)
        if springs is not None:
            self._springs = self._restraint.copy()
            enlarge_by_springs(self._springs, self.as_springs(springs), self.sum)
        elif restraint is None:
            return
        self._springs_pattern = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN
        self._stiffness_diagonal = np.array(self._elastic.getDiagonal().array_r + self._springs.getDiagonal().array_r)

    @property
    def rigid_motions(self) -> Array:
        """Motions without strain in closed form, orthonormal, (n, 3) or (n, 6)."""
        return self._rigid

    def matrices(self) -> tuple[PETSc.Mat, PETSc.Mat]:
        """Return M and K, made for the caller. Collective."""
        return self._whole_mass(), self._whole_stiffness()

    def products(self) -> tuple[PETSc.Mat, PETSc.Mat]:
        """Return M and K as PETSc's matrices that know their products only. Collective."""
        return as_matrix(self.apply_mass, self._elastic), as_matrix(self.apply_stiffness, self._elastic)

    def with_springs(self, on_mass: Sequence[Springs], on_stiffness: Sequence[Springs]) -> tuple[PETSc.Mat, PETSc.Mat]:
        """Return M and K with more on some of their DOFs, which may couple DOFs of different cells. Collective."""
        results = self.matrices()
        for matrix, added in zip(results, (on_mass, on_stiffness), strict=True):
            for springs in added:
                enlarge_by_springs(matrix, springs, self.sum)
        return results

    def as_springs(self, added: RankOnes) -> Springs:
        """Return sum_j a_j b_j b_j^T as a matrix on the DOFs where the b_j are not zero. Collective."""
        owned = np.flatnonzero(np.any(added.patterns != 0.0, axis=0))
        counts = self._comm.allgather(len(owned))
        slots = sum(counts[: self._comm.rank]) + np.arange(len(owned))
        patterns = np.zeros((len(added.coefficients), sum(counts)))
        patterns[:, slots] = added.patterns[:, owned]
        everywhere = RankOnes(self.sum(patterns), added.coefficients)
        return Springs(Interface(sum(counts), owned, slots), csr_matrix(everywhere.matrix))

    def apply_mass(self, x: Array) -> Array:
        """Return M x, (n,) or, of several columns, (n, k). Collective."""
        if x.ndim == 2:
            wide = x.reshape(-1, self._components * x.shape[1])  # of a node: all columns of all components
            return columns_product(self._component_mass, wide).reshape(x.shape)
        self._components_in.getDenseArray()[:] = x.reshape(-1, self._components)
        self._component_mass.matMult(self._components_in, self._components_out)
        return np.ascontiguousarray(self._components_out.getDenseArray()).reshape(-1)

    def apply_stiffness(self, x: Array) -> Array:
        """Return K x, (n,) or, of several columns, (n, k). Collective."""
        if self.smooth is not None:
            elastic = self.smooth.product(lambda rest: self._product(self._elastic, rest))(x)
        else:  # without the round-off that products have on rigid-body modes
            elastic = self._product(self._elastic, x - self._rigid @ self.sum(self._rigid.T @ x))
        return elastic + self._product(self._springs, x)

    def stiffness_round_off(self, x: Array) -> Array:
        """Return about how far the entries of K x are off by round-off."""
        return np.asarray(np.finfo(float).eps * self._stiffness_diagonal * np.abs(x))

    def apply_restraint(self, x: Array) -> Array:
        """Return the part of K x that the restraint adds, (n,) or (n, k). Collective."""
        return self._product(self._restraint, x)

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> Factor:
        """Return a solver for c_M M + c_K K + springs + rank-one terms (options prefix gapbeam_effective_).

        Where M alone is asked for, rows of massless DOFs are those of K, which hold them in static equilibrium.

        Raises:
            RunError: The factorization failed, from lack of memory or because the operator is singular.

        Collective.
        """
        effective = self._whole_stiffness()
        if stiffness != 0.0 or not self.has_massless:
            effective.scale(stiffness)
        else:
            first = effective.getOwnershipRange()[0]
            effective.zeroRowsColumns((first + np.flatnonzero(~self.massless)).astype(PETSc.IntType), diag=0.0)
        if mass != 0.0:
            effective.axpy(mass, self._whole_mass(), self._mass_pattern)
        if springs is not None:
            add_springs(effective, springs, self.sum)
        effective.setOption(PETSc.Mat.Option.SPD, True)
        if self.solver.iterative and stiffness != 0.0:
            rigid = self._images(mass, stiffness, self._rigid, None, springs, added)
            return self._iterated(effective, "gapbeam_effective_", self.solver.tolerance, added, rigid)
        factor = self._factored(effective, "gapbeam_effective_")
        if self.smooth is not None and springs is None and 0.0 < stiffness * self._fastest < FAST * mass:
            images = self._images(mass, stiffness, self.smooth.basis, self.smooth.images)
            factor = DeflatedFactor(factor, Deflation(self.smooth.basis, images, self.sum))
        elif mass == 0.0 and springs is not None and added is None:
            images = self._images(mass, stiffness, self._rigid, None, springs)
            least = float(np.linalg.eigvalsh(self.sum(self._rigid.T @ images))[0])
            if 0.0 < least < FEW_DIGITS * np.finfo(float).eps * stiffness * self._stiffest:
                factor = DeflatedFactor.symmetric(factor, Deflation(self._rigid, images, self.sum))
        return updated(factor, self, added)

    def solver_of(self, matrix: PETSc.Mat, prefix: str, tolerance: float) -> Factor:
        """Return a solver for a symmetric positive definite matrix on the body's DOFs.

        Args:
            matrix: The matrix; it is taken over.
            prefix: Prefix of PETSc's options.
            tolerance: Error over solution, if by iterations.

        Raises:
            RunError: The factorization failed, from lack of memory or because the operator is singular.

        Collective.
        """
        if self.solver.iterative:
            return self._iterated(matrix, prefix, tolerance)
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        return self._factored(matrix, prefix)

    def shifted_factor(self, shift: float) -> Factor:
        """Return a solver for K + sigma M of this body, as `solver_of` does (prefix gapbeam_shifted_). Collective.

        M on its own is there for no longer than that takes.
        """
        shifted, tolerance = self._whole_stiffness(), self.solver.basis_tolerance
        shifted.axpy(shift, self._whole_mass(), self._mass_pattern)
        if self.solver.iterative:
            return self._iterated(shifted, SHIFTED, tolerance, None, self._images(shift, 1.0, self._rigid, None))
        return self.solver_of(shifted, SHIFTED, tolerance)

    def shifted_solver(self, mass: PETSc.Mat, stiffness: PETSc.Mat, shift: float, tolerance: float) -> Factor:
        """Return a solver for K + sigma M (prefix gapbeam_shifted_) like `solver_of`; takes K over. Collective."""
        stiffness.axpy(shift, mass, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        return self.solver_of(stiffness, SHIFTED, tolerance)

    def _iterated(
        self,
        matrix: PETSc.Mat,
        prefix: str,
        tolerance: float,
        added: RankOnes | None = None,
        images: Array | None = None,
    ) -> ConjugateGradients:
        return ConjugateGradients(matrix, self._space, self._rigid, self, prefix, tolerance, added, images)

    def _images(
        self,
        mass: float,
        stiffness: float,
        motions: Array,
        elastic: Array | None,
        springs: Springs | None = None,
        added: RankOnes | None = None,
    ) -> Array:
        """Return (mass M + stiffness K + springs + added) of motions, (n, k), with known elastic forces.

        Args:
            mass: c_m.
            stiffness: c_k.
            motions: The motions, (n, k).
            elastic: Their elastic forces, (n, k); None: they are motions without strain.
            springs: Springs.
            added: Rank-one terms.

        Collective.
        """
        images = np.empty_like(motions)
        for number, motion in enumerate(motions.T):
            held = self._product(self._springs, motion)
            image = mass * self.apply_mass(motion) + stiffness * (
                held if elastic is None else elastic[:, number] + held
            )
            if springs is not None:
                springs.interface.add(image, springs.matrix @ springs.interface.trace(motion, self))
            if added is not None:
                image += added.apply(motion, self)
            images[:, number] = image
        return images

    def _factored(self, matrix: PETSc.Mat, prefix: str) -> Factor:
        try:
            return factor_on_ranks(matrix, prefix, self.sum, self.solver.columns_limit)
        except PETSc.Error as error:
            raise not_factored(matrix.getSize()[0], error) from error

    def sum(self, local: Array) -> Array:
        """Sum a small array over all ranks, to the same bits on every rank. Collective."""
        if self._comm.size == 1:
            return local
        total = np.empty_like(local, order="C")
        # Not Allreduce: its result may differ in the last bit between ranks, and decisions are taken on it.
        self._comm.Reduce(np.ascontiguousarray(local), total)
        self._comm.Bcast(total)
        return total

    def _whole_stiffness(self) -> PETSc.Mat:
        stiffness = self._elastic.copy()
        stiffness.axpy(1.0, self._springs, self._springs_pattern)
        return stiffness

    def _whole_mass(self) -> PETSc.Mat:
        """Return M, of the block that every component has."""
        starts, columns, values = self._component_mass.getValuesCSR()
        local = csr_matrix((values, columns, starts), (len(starts) - 1, self._component_mass.getSize()[1]))
        whole = kron(local, identity(self._components), format="csr")
        pattern = whole.indptr.astype(PETSc.IntType), whole.indices.astype(PETSc.IntType), whole.data
        mass = PETSc.Mat().createAIJ(self._elastic.getSizes(), bsize=self._components, csr=pattern, comm=self._comm)
        mass.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        return mass

    def _product(self, matrix: PETSc.Mat, x: Array) -> Array:
        if x.ndim == 2:
            return columns_product(matrix, x)
        self._vector_in.array[:] = x
        matrix.mult(self._vector_in, self._vector_out)
        return np.array(self._vector_out.array_r)
