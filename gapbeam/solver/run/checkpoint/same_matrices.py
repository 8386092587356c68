"""Comparison of stored matrices with those of a model set up anew, in another basis of the same motions.

    b_i (K + s M)^-1 b_j,    b_i (K + s M)^-1 M (K + s M)^-1 b_j    and the same with the restraint instead of M

do not depend on the basis, where the b are loads, gaps, contact forces and probes, and s is the square of a frequency.
Of motions that joints hold, which the basis does not have, b is the inertia along the shapes that give their forces.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh

from gapbeam.solver.assembly.assembled_system import attached_rows
from gapbeam.solver.loads.load_parts import patterned
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.reduction.projection import DenseRow
from gapbeam.solver.run.checkpoint.checkpoint_files import BrokenCheckpoint
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array

FLOATING = 1.0e-8  # of the largest square of a frequency: rigid motions on the weak restraint are below it
HELD = 1.0e-9  # of the largest response: that of a place that a joint holds, which the basis cannot move, is round-off
NOTHING = 1.0e-6  # of the whole energy: what the restraint may have without being looked at
ALIKE = 1.0e-3  # relative: bases that are found on other ranks span the same motions to some 1e-6


def refuse_other_matrices(kept: Body, found: Body, comm: MPI.Comm) -> None:
    """Refuse a body whose matrices respond otherwise than those found anew; one that is marched on its mesh passes.

    Raises:
        BrokenCheckpoint: They do.

    Collective.
    """
    if kept.operators is found.operators or not isinstance(found.operators, DenseOperators):
        return
    try:
        faults = _faults(kept, found, comm)
    except (LinAlgError, ValueError, TypeError) as error:
        faults = [str(error)]
    faults = comm.bcast(faults)
    if faults:
        raise BrokenCheckpoint("the matrices that were kept are not those of this model: " + "; ".join(faults))


def _faults(kept: Body, found: Body, comm: MPI.Comm) -> list[str]:
    same = (kept.contact.weights, found.contact.weights), (kept.contact.initial_gap, found.contact.initial_gap)
    places = (kept.contact.positions, found.contact.positions), (kept.contact.faces, found.contact.faces)
    faults = [
        "contact points of other places, areas or gaps"
        for one, other in (*same, *places)
        if not np.allclose(one, other, rtol=ALIKE, atol=ALIKE * float(np.max(np.abs(other), initial=0.0)))
    ]
    faults += [
        "joints hold them otherwise"
        for one, other in zip(_along_holds(kept), _along_holds(found), strict=True)
        if not np.allclose(one, other, rtol=ALIKE, atol=ALIKE * float(np.max(np.abs(other), initial=0.0)))
    ]
    shift = _shift(found)
    responses, others = (_responses(body, shift) for body in (kept, found))
    energies = np.abs(np.diagonal(others[0]))
    for one, other in zip(responses, others, strict=True):
        size = np.sqrt(np.maximum(np.abs(np.diagonal(other)), NOTHING * energies if other is others[-1] else 0.0))
        size = np.maximum(size, HELD * np.max(size, initial=0.0))
        if one.shape != other.shape or not np.all(np.abs(one - other) <= ALIKE * np.outer(size, size)):
            faults.append("they respond otherwise to loads and contact")
    moved, expected = (_motion(body, shift) for body in (kept, found))
    off, whole = (comm.allreduce(float(np.sum(x**2))) for x in (moved - expected, expected))
    if not off <= ALIKE**2 * whole:
        faults.append("the mesh moves otherwise with them")
    return list(dict.fromkeys(faults))


def _shift(body: Body) -> float:
    """Return the square of the lowest elastic frequency, 1/s^2: the highest of a basis are those of its round-off."""
    operators = body.operators
    assert isinstance(operators, DenseOperators)
    squares = eigh(operators.stiffness, operators.mass, eigvals_only=True)
    return float(np.min(squares[squares > FLOATING * squares.max()]))


def _along_holds(body: Body) -> list[Array]:
    """Return the effects of loads and contact along the shapes of held motions, whatever the basis is."""
    held = body.holding
    return [] if held is None else [held.patterns, held.pressure, held.friction]


def _rows(body: Body) -> Array:
    """Return the rows by which a model is loaded and observed, (rows, n)."""
    contact, size = body.contact, len(body.patterns[0]) if body.patterns else body.contact.interface.size
    traced = np.zeros((contact.interface.size, size))
    traced[contact.interface.slots, contact.interface.owned] = 1.0
    seen = [*body.patterns[: len(patterned(body.case.load))]]
    seen += [row for one, row in attached_rows(body.case, body.patterns) if not one.held]
    seen += [] if body.holding is None else [*body.holding.mass]
    rows = [*seen, *(contact.gap_matrix @ traced), *(contact.resultants.T @ traced)]
    for probe in body.probes.values():
        assert isinstance(probe, DenseRow)
        rows += [*probe.matrix]
    return np.array(rows)


def _static(body: Body, shift: float) -> Array:
    operators, rows = body.operators, _rows(body)
    assert isinstance(operators, DenseOperators)
    return np.asarray(cho_solve(cho_factor(operators.stiffness + shift * operators.mass), rows.T))


def _responses(body: Body, shift: float) -> tuple[Array, Array, Array]:
    """Return twice the energies of all, of the motion and of the restraint, that pairs of rows have together."""
    operators, moved = body.operators, _static(body, shift)
    assert isinstance(operators, DenseOperators)
    return _rows(body) @ moved, moved.T @ operators.mass @ moved, moved.T @ operators.restraint @ moved


def _motion(body: Body, shift: float) -> Array:
    """Return the motion of the nodes of this rank under each row, scaled by the mass that moves with them."""
    operators, moved = body.operators, _static(body, shift)
    assert isinstance(operators, DenseOperators)
    size = np.sqrt(np.abs(np.sum(moved * (operators.mass @ moved), axis=0)))
    scaled = moved / np.maximum(size, max(HELD * float(np.max(size, initial=0.0)), np.finfo(float).tiny))
    return scaled if body.expansion is None else np.asarray(body.expansion @ scaled)
