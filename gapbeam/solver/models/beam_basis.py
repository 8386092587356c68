"""The basis of beams of many elements: their lowest vibration modes, and what contact and loads make of the rest.

    u = V q,    V = [modes, A^-1 B^T, A^-1 f],    A = K + sigma M

B are the motions of the contact points: the static flexibility of the contact faces is kept (Rubin 1975). All solves
are with sparse factors.
"""

from __future__ import annotations

from math import ceil, pi

import numpy as np
from scipy.sparse import csr_matrix, vstack

from gapbeam.solver.assembly.attached_motions import acting_rows
from gapbeam.solver.case.bending_waves import bending_wavelength
from gapbeam.solver.case.element_spacing import highest_frequency
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.reduction.basis_report import MODES_ABOVE, BasisReport
from gapbeam.solver.models.reduction.modal_basis import Basis, modal_basis
from gapbeam.solver.models.reduction.truncation_check import neglected_shares, random_pressures
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator
from gapbeam.solver.system.sparse_operators import SparseFactor, SparseOperators

FEWEST_MODES = 100
INDEPENDENT = 1.0e-7  # of the largest motion of a face
FAINT = 1.0e-6  # of the flexibility of a face


def floating_basis(body: Body, operators: SparseOperators, shift: float, planes: int) -> tuple[Basis, BasisReport]:
    """Return the basis of a beam before joints hold it, and what it neglects.

    Args:
        body: The beam, with all of its DOFs.
        operators: Its M and K.
        shift: sigma > 0, 1/s^2.
        planes: In how many ways it moves: bending in one plane or two, tension, twist.

    Raises:
        NotConverged: Nothing holds the beam.
        RunError: Its modes could not be found.
    """
    factor = operators.factor(shift, 1.0)
    count = min(mode_count(body) * planes, operators.size // 2)
    squares, modes = operators.lowest_modes(shift, count, factor)
    pressed, acting = pushed(body.contact, factor), acting_rows(body.case, body.patterns)
    vectors = np.concatenate([modes, pressed, *(factor.solve(row)[:, None] for row in acting)], axis=1)
    basis = modal_basis(operators, vectors, shift)
    pressures = random_pressures(body.contact, 1)
    (missing,) = neglected_shares(operators, body.contact, factor, basis, shift, [pressures])
    report = BasisReport(
        modes=count,
        highest_mode=float(np.sqrt(squares[-1]) / (2.0 * pi)),
        contact_shapes=pressed.shape[1],
        load_shapes=len(acting),
        size=len(basis.squares),
        left_out=0,
        highest=float(np.sqrt(basis.squares.max()) / (2.0 * pi)),
        neglected=missing,
        neglected_smooth=missing,
    )
    return basis, report


def mode_count(body: Body) -> int:
    """Return how many modes in a plane reach well above the highest frequency of interest."""
    case = body.case
    highest = MODES_ABOVE * highest_frequency(case)
    wavelength = min(bending_wavelength(piece, highest) for piece in case.profile.pieces)
    return max(FEWEST_MODES // 2, ceil(2.0 * case.beam.length / wavelength) + 2)


def pushed(contact: ContactOperator, factor: SparseFactor) -> Array:
    """Return responses to forces that span nearly all that contact can do to a beam, (n, k).

    Of the responses to all forces on a face those are left out whose flexibility is below FAINT of the largest: forces
    that nearly balance each other within a short support.
    """
    rows = csr_matrix(contact.gap_matrix)
    if contact.rubbed is not None:
        rows = csr_matrix(vstack([rows, contact.rubbed]))
    faces = np.concatenate([contact.faces, np.repeat(contact.faces, rows.shape[0] // contact.size - 1)])
    found = list[Array]()
    for face in range(len(contact.face_names)):
        forces = _directions(rows[np.flatnonzero(faces == face)])
        responses = factor.solve(forces.T)
        flexibility = forces @ responses
        sizes, mixes = np.linalg.eigh(0.5 * (flexibility + flexibility.T))
        found.append(responses @ mixes[:, sizes > FAINT * sizes[-1]])
    return np.concatenate(found, axis=1)


def _directions(rows: csr_matrix) -> Array:
    """Return orthogonal rows, (k, n), with the same products R^T R as given ones, but for round-off."""
    touched = np.unique(rows.indices)
    _, sizes, directions = np.linalg.svd(rows[:, touched].toarray(), full_matrices=False)
    independent = sizes > INDEPENDENT * sizes[0]
    kept = sizes[independent, None] * directions[independent]
    found = np.zeros((len(kept), rows.shape[1]))
    found[:, touched] = kept
    return found
