"""Distributed operators of a finite element model: PETSc matrices, MUMPS factors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from solver.attached import updated
from solver.elasticity import ElasticForms
from solver.errors import RunError, UserError
from solver.operators import Array, Factor, Interface, RankOnes, Springs
from solver.rigid_motions import rigid_motions

SOLVE_BLOCK = 64  # right sides at once when the Delassus operator is made


class PetscFactor:
    """MUMPS Cholesky factor of an effective operator.

    Args:
        matrix: A, or a matrix of the same layout where its factor is there already.
        preconditioner: The factor of A as a preconditioner.
        owner: What made the factor and would take it along when it goes.
    """

    def __init__(self, matrix: PETSc.Mat, preconditioner: PETSc.PC, owner: object = None) -> None:
        self._matrix, self._preconditioner, self._owner = matrix, preconditioner, owner
        self._solution, self._right_side = matrix.createVecs()

    @classmethod
    def of(cls, matrix: PETSc.Mat, prefix: str) -> PetscFactor:
        """Factor a matrix, with a prefix for PETSc's options. Collective."""
        preconditioner = PETSc.PC().create(matrix.comm)
        preconditioner.setOptionsPrefix(prefix)
        preconditioner.setOperators(matrix)
        preconditioner.setType("cholesky")
        preconditioner.setFactorSolverType("mumps")
        preconditioner.setFromOptions()
        preconditioner.setUp()
        return cls(matrix, preconditioner)

    def solve(self, right_side: Array) -> Array:
        """Return A^-1 b. Collective."""
        self._right_side.array[:] = right_side
        self._preconditioner.apply(self._right_side, self._solution)
        return np.array(self._solution.array_r)

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        """Return A^-1 E X for columns X on the interface DOFs, (n, r), column-major. Collective."""
        matrix = self._matrix
        local, total = matrix.getLocalSize()[0], matrix.getSize()[0]
        wanted, mine = columns.shape[1], columns[interface.slots].tocsc()
        result = np.empty((local, wanted), order="F")
        factored = self._preconditioner.getFactorMatrix()
        for first in range(0, wanted, SOLVE_BLOCK):
            count = min(SOLVE_BLOCK, wanted - first)
            units, solved = (
                PETSc.Mat().createDense(((local, total), (PETSc.DECIDE, count)), comm=matrix.comm) for _ in "bx"
            )
            units.setUp()
            solved.setUp()
            units.getDenseArray()[interface.owned] = mine[:, first : first + count].toarray()
            for dense in (units, solved):
                dense.assemble()
            factored.matSolve(units, solved)
            result[:, first : first + count] = solved.getDenseArray()
            units.destroy()
            solved.destroy()
        return result


class PetscOperators:
    """M, K and restraint of a finite element model.

    Args:
        forms: The UFL forms.
        space: The vector space they live on.
        correction: What a contact formulation adds to K.
        lumped: Make M diagonal.
        extrapolation: E, which moves mass from the contact nodes into the body (`solver.mass_redistribution`).

    Raises:
        UserError: A lumped mass is not positive.

    Collective to make and to use.
    """

    def __init__(
        self,
        forms: ElasticForms,
        space: fem.FunctionSpace,
        correction: Springs | None = None,
        lumped: bool = False,
        extrapolation: PETSc.Mat | None = None,
    ) -> None:
        self._comm = space.mesh.comm
        self._mass = mass_matrix(_assemble(forms.mass), lumped, extrapolation)
        diagonal = np.array(self._mass.getDiagonal().array_r)
        self.massless = diagonal == 0.0
        self._has_massless = bool(self._comm.allreduce(np.any(self.massless), op=MPI.LOR))
        self._restraint = _assemble(forms.restraint)
        self._elastic = _assemble(forms.stiffness)
        if correction is not None:
            self._add_springs(self._elastic, correction)
        self._stiffness = self._elastic.copy()
        self._stiffness.axpy(1.0, self._restraint, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self._rigid = rigid_motions(space)
        self._components = space.dofmap.index_map_bs
        self.size = self._mass.getLocalSize()[0]
        # Every component has the same mass matrix: a product with it, of all components at once, reads a ninth (3D).
        first, _ = self._mass.getOwnershipRange()
        rows = PETSc.IS().createStride(self.size // self._components, first, self._components, comm=self._comm)
        self._component_mass = self._mass.createSubMatrix(rows, rows)
        nodes = self._component_mass.getSizes()[1]
        self._components_in = PETSc.Mat().createDense((nodes, (PETSc.DECIDE, self._components)), comm=self._comm)
        self._components_in.setUp()
        self._components_in.assemble()
        self._components_out = self._component_mass.matMult(self._components_in)
        self._vector_in, self._vector_out = self._stiffness.createVecs()
        self._stiffness_diagonal = np.array(self._stiffness.getDiagonal().array_r)

    @property
    def matrices(self) -> tuple[PETSc.Mat, PETSc.Mat]:
        """M and K; not to be changed."""
        return self._mass, self._stiffness

    def with_springs(self, on_mass: Sequence[Springs], on_stiffness: Sequence[Springs]) -> tuple[PETSc.Mat, PETSc.Mat]:
        """Return M and K with more on some of their DOFs, which may couple DOFs of different cells. Collective."""
        results = []
        for matrix, added in ((self._mass, on_mass), (self._stiffness, on_stiffness)):
            result = matrix.copy() if added else matrix
            result.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
            for springs in added:
                self._add_springs(result, springs)
            results.append(result)
        return results[0], results[1]

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
        """Return M x. Collective."""
        self._components_in.getDenseArray()[:] = x.reshape(-1, self._components)
        self._component_mass.matMult(self._components_in, self._components_out)
        return np.ascontiguousarray(self._components_out.getDenseArray()).reshape(-1)

    def apply_stiffness(self, x: Array) -> Array:
        """Return K x. Collective."""
        return self._product(self._elastic, self._deformed(x)) + self._product(self._restraint, x)

    def stiffness_round_off(self, x: Array) -> Array:
        """Return about how far the entries of K x are off by round-off."""
        return np.asarray(np.finfo(float).eps * self._stiffness_diagonal * np.abs(x))

    def apply_restraint(self, x: Array) -> Array:
        """Return the part of K x that the restraint adds. Collective."""
        return self._product(self._restraint, x)

    def factor(
        self, mass: float, stiffness: float, springs: Springs | None = None, added: RankOnes | None = None
    ) -> Factor:
        """Factor mass M + stiffness K + springs + added by MUMPS (options prefix gapbeam_effective_).

        Where M alone is asked for, rows of massless DOFs are those of K, which hold them in static equilibrium.

        Raises:
            RunError: The factorization failed, from lack of memory or because the operator is singular.

        Collective.
        """
        effective = self._stiffness.copy()
        if stiffness != 0.0 or not self._has_massless:
            effective.scale(stiffness)
        else:
            first = effective.getOwnershipRange()[0]
            effective.zeroRowsColumns((first + np.flatnonzero(~self.massless)).astype(PETSc.IntType), diag=0.0)
        if mass != 0.0:
            effective.axpy(mass, self._mass, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        if springs is not None:
            self._add_springs(effective, springs)
        effective.setOption(PETSc.Mat.Option.SPD, True)
        try:
            factor = PetscFactor.of(effective, "gapbeam_effective_")
        except PETSc.Error as error:
            raise RunError(
                f"the effective operator with {effective.getSize()[0]} DOFs could not be factored ({error}); "
                "a coarser mesh needs less memory"
            ) from error
        return updated(factor, self, added)

    def sum(self, local: Array) -> Array:
        """Sum a small array over all ranks, to the same bits on every rank. Collective."""
        if self._comm.size == 1:
            return local
        total = np.empty_like(local, order="C")
        # Not Allreduce: its result may differ in the last bit between ranks, and decisions are taken on it.
        self._comm.Reduce(np.ascontiguousarray(local), total)
        self._comm.Bcast(total)
        return total

    def _deformed(self, x: Array) -> Array:
        """Return x without its rigid part, which elasticity does not feel: it would only bring round-off into K x."""
        return np.asarray(x - self._rigid @ self.sum(self._rigid.T @ x))

    def _add_springs(self, effective: PETSc.Mat, springs: Springs) -> None:
        interface, matrix = springs.interface, springs.matrix
        first = effective.getOwnershipRange()[0]
        mine = np.zeros(interface.size)
        mine[interface.slots] = interface.owned + first
        place = self.sum(mine)
        for slot, owned in zip(interface.slots, interface.owned, strict=True):
            entries = slice(matrix.indptr[slot], matrix.indptr[slot + 1])
            columns = place[matrix.indices[entries]].astype(PETSc.IntType)
            effective.setValues([int(owned + first)], columns, matrix.data[entries], addv=PETSc.InsertMode.ADD_VALUES)
        effective.assemble()

    def _product(self, matrix: PETSc.Mat, x: Array) -> Array:
        self._vector_in.array[:] = x
        matrix.mult(self._vector_in, self._vector_out)
        return np.array(self._vector_out.array_r)


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


def _assemble(form: Any) -> PETSc.Mat:
    matrix = fem_petsc.assemble_matrix(fem.form(form))
    matrix.assemble()
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return matrix
