"""The mass matrix: consistent or lumped, with mass redistributed from the contact faces on request."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from gapbeam.solver.messages.errors import UserError


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
