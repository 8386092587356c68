"""A basis without the motions that joints hold.

Of q with B q = 0, B = R V of the rows R of the motions held, in coordinates y = (s + sigma)^(1/2) q in which the energy
of K + sigma M is 1: the eigenvalues 1 / (s' + sigma) of its inertia on the null space of B (s + sigma)^(-1/2) give the
low frequencies of the held body to full accuracy, and their vectors its vibration modes. The null space is that of
Householder reflections, which leave alone what no joint holds, such as the lateral motions of a symmetric body.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr

from gapbeam.solver.assembly.attached_motions import attached_rows
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.reduction.modal_basis import Basis

INDEPENDENT = 1.0e-10  # of a row of unit length: two holds may hold the same motion


def held(body: Body, basis: Basis, shift: float) -> Basis:
    """Return the basis of the held body, in its modal coordinates; the same where no joint holds anything.

    Args:
        body: The body.
        basis: V, with V^T M V = 1 and V^T K V = diag(s).
        shift: sigma > 0, 1/s^2, about the square of the lowest angular frequency.

    Collective.
    """
    holding = [row for one, row in attached_rows(body.case, body.patterns) if one.held]
    if not holding:
        return basis
    motions = np.stack([basis.project(body.operators, row) for row in holding])
    soft = 1.0 / np.sqrt(basis.squares + shift)
    motions = motions * soft
    lengths = np.linalg.norm(motions, axis=1, keepdims=True)
    rotation, triangle, _ = qr((motions / np.where(lengths > 0.0, lengths, 1.0)).T, pivoting=True)
    sizes = np.abs(np.diagonal(triangle))
    free = rotation[:, np.count_nonzero(sizes > INDEPENDENT * sizes.max()) :]
    compliances, modes = np.linalg.eigh(free.T @ (soft[:, None] ** 2 * free))
    compliances, modes = compliances[::-1], modes[:, ::-1]
    columns = basis.columns @ (soft[:, None] * (free @ (modes / np.sqrt(compliances))))
    return Basis(np.asfortranarray(columns), np.maximum(1.0 / compliances - shift, 0.0))
