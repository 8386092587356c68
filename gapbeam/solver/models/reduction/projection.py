"""Projection of a finite element body on a basis, u = V q: operators, contact, loads, probes and joint forces.

A basis V without the motions that joints hold, B V = 0, knows nothing of the forces lambda that hold them. These follow
from the equation along shapes Z with B Z = 1, of the same body before it is held:

    lambda = Z^T (M a + C v + K u - f - H^T (w p)),    u = V q

Z are the static shapes of K + sigma M under unit forces along B. Every Z gives the same lambda, for the residual of the
held body lies in the span of B^T.

Such a basis is found in coordinates of unit energy. Of q with B q = 0, B = R V of the rows R of the motions held, in
coordinates y = (s + sigma)^(1/2) q in which the energy of K + sigma M is 1: the eigenvalues 1 / (s' + sigma) of its
inertia on the null space of B (s + sigma)^(-1/2) give the low frequencies of the held body to full accuracy, and their
vectors its vibration modes. Householder reflections give the null space; they do not change what no joint holds, such
as the lateral motions of a symmetric body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.assembled_system import attached_rows
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.loads.places import patterned
from gapbeam.solver.models.body import Body, HoldingShapes, ProductExpansion
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.system.dense_operators import DenseOperators, SparseOperators
from gapbeam.solver.system.operators import Array, Interface, Operators, row_product
from gapbeam.solver.system.semi_discrete import ContactOperator

Kept = NDArray[np.bool_]

UNMOVED = 1.0e-8  # of the largest motion that a unit force gives a mode
FLOATING = 1.0e-3  # of the shift: squares of motions of the floating body on weak springs


@dataclass(frozen=True)
class DenseRow:
    """Basis functions at one point in terms of reduced DOFs, (components, r), which come first among those marched."""

    matrix: Array

    def evaluate(self, x: Array, _operators: Operators) -> Array:
        """Return the vector field at the point, (components,), or row by row of x, (times, components)."""
        x = x[..., : self.matrix.shape[1]]
        return np.asarray(x @ self.matrix.T) if x.ndim == 1 else row_product(x, self.matrix.T)


def projected(body: Body, contact: ContactOperator, basis: Basis) -> Body:
    """Return the body in terms of q.

    Args:
        body: The finite elements.
        contact: Their contact points, or fewer.
        basis: V with V^T M V = 1, V^T K V = diag(s).

    Collective.
    """
    operators = body.operators
    held = basis.project(operators, operators.apply_restraint(basis.columns))
    size = len(basis.squares)
    elastic = np.diag(basis.squares) - held
    trace = _trace(operators, contact.interface, basis)
    everywhere = Interface(size, np.arange(size), np.arange(size))
    columns = np.ascontiguousarray(basis.columns.T)
    return replace(
        body,
        operators=DenseOperators(np.identity(size), elastic, 0.5 * (held + held.T)),
        contact=_in_terms_of(contact, everywhere, trace),
        patterns=tuple(basis.project(operators, pattern) for pattern in body.patterns),
        probes={
            name: DenseRow(np.stack([probe.evaluate(column, operators) for column in columns], axis=1))
            for name, probe in body.probes.items()
        },
        rigid=np.stack([basis.project(operators, row) for row in body.rigid]),
        expansion=basis.columns,
    )


def spanned(body: Body, operators: SparseOperators, columns: csr_matrix) -> tuple[Body, SparseOperators]:
    """Return a beam in terms of q, u = V q with sparse V, and its M and K.

    Args:
        body: The beam, with all of its DOFs.
        operators: Its M and K.
        columns: V, (n, r).
    """
    size, dual, whole = columns.shape[1], csr_matrix(columns.T), body.expansion
    assert isinstance(whole, csr_matrix | ProductExpansion)
    parts = (dual @ one @ columns for one in (operators.mass, operators.elastic, operators.restraint))
    everywhere, projected = Interface(size, np.arange(size), np.arange(size)), SparseOperators(*parts)
    moved = replace(
        body,
        operators=projected,
        contact=_in_terms_of(body.contact, everywhere, columns),
        patterns=tuple(dual @ pattern for pattern in body.patterns),
        probes={name: DenseRow(row.matrix @ columns) for name, row in body.probes.items() if isinstance(row, DenseRow)},
        rigid=(dual @ body.rigid.T).T,
        expansion=whole @ columns if isinstance(whole, ProductExpansion) else ProductExpansion(whole, columns),
    )
    return moved, projected


def moved(body: Body, contact: ContactOperator, basis: Basis, shift: float) -> tuple[Basis, Kept]:
    """Return a basis and True for its columns that loads or contact can move, (r,): symmetric ones. Collective.

    Round-off mixes motions of the floating body, which are alike beside the shift. Those that are moved then seem more
    than there are: they are turned so that as few are moved as can be, unless stiffness ties the others to these.

    Args:
        body: The body.
        contact: Its contact points, whose gaps are those of symmetric motions.
        basis: V, with V^T M V = 1 and V^T K V = diag(s).
        shift: As in `held`.
    """
    operators = body.operators
    trace = _trace(operators, contact.interface, basis)
    gaps = np.sqrt(contact.weights[:, None]) * (contact.gap_matrix @ trace)
    # a basis does not move where a joint holds it: what is left there is round-off
    free = [row for one, row in attached_rows(body.case, body.patterns) if not one.held]
    patterns = (*body.patterns[: len(patterned(body.case.load))], *free)
    rows = [gaps / np.linalg.norm(gaps, axis=0).max()]
    for force in (basis.project(operators, pattern) for pattern in patterns):
        rows.append(force[None] / (np.abs(force).max() or 1.0))
    movers = np.vstack(rows)
    found: Kept = np.linalg.norm(movers, axis=0) > UNMOVED
    low = np.flatnonzero(basis.squares < FLOATING * shift)
    if not found[low].any():
        return basis, found
    _, sizes, turn = np.linalg.svd(np.linalg.qr(movers[:, low], mode="r"))
    rank = int(np.count_nonzero(sizes > UNMOVED))
    tie = (turn[:rank] * basis.squares[low]) @ turn[rank:].T
    if rank == np.count_nonzero(found[low]) or np.abs(tie).max(initial=0.0) > UNMOVED * shift:
        return basis, found
    columns, squares = basis.columns.copy(order="F"), basis.squares.copy()
    for place, some in ((low[:rank], turn[:rank]), (low[rank:], turn[rank:])):
        own, shapes = np.linalg.eigh((some * basis.squares[low]) @ some.T)
        columns[:, place], squares[place] = basis.columns[:, low] @ (some.T @ shapes), np.maximum(own, 0.0)
    found[low] = np.arange(len(low)) < rank
    order = np.argsort(squares, kind="stable")
    return Basis(np.asfortranarray(columns[:, order]), squares[order]), found[order]


def _trace(operators: Operators, interface: Interface, basis: Basis) -> Array:
    """Return the interface values of a basis on every rank, (interface.size, r). Collective."""
    values = np.zeros((interface.size, len(basis.squares)))
    values[interface.slots] = basis.columns[interface.owned]
    return operators.sum(values)


def _in_terms_of(contact: ContactOperator, interface: Interface, trace: Array | csr_matrix) -> ContactOperator:
    """Return an operator on reduced DOFs whose interface values are `trace` q."""
    tangents = None if contact.tangents is None else _sparse(contact.tangents @ trace)
    moved = replace(contact, interface=interface, gap_matrix=_sparse(contact.gap_matrix @ trace), tangents=tangents)
    if isinstance(moved, ResultantOperator):
        return replace(moved, distributed=_in_terms_of(moved.distributed, interface, trace))
    return moved


def _sparse(filled: Array | csr_matrix) -> csr_matrix:
    """Return rows that are mostly filled, without the zeros that planes which do not meet leave."""
    if not isinstance(filled, np.ndarray):
        return csr_matrix(filled)
    kept = filled != 0.0
    starts = np.concatenate([[0], np.cumsum(np.count_nonzero(kept, axis=1))])
    columns = np.broadcast_to(np.arange(filled.shape[1], dtype=np.int32), filled.shape)[kept]
    return csr_matrix((filled[kept], columns, starts), filled.shape)


INDEPENDENT = 1.0e-10  # of a motion of unit length: two holds may hold the same motion, and share its force


def held_rows(body: Body) -> Array:
    """Return the rows of the motions that joints hold, (h, n)."""
    rows = [row for one, row in attached_rows(body.case, body.patterns) if one.held]
    return np.stack(rows) if rows else np.zeros((0, body.operators.size))


def holding_shapes(
    body: Body, contact: ContactOperator, respond: Callable[[Array], Array], held: Array | csr_matrix
) -> HoldingShapes | None:
    """Return the products of the held body along Z; None where no joint holds anything.

    Args:
        body: The body before joints hold it.
        contact: The contact points that the held body keeps, on the DOFs of the body.
        respond: Returns its static responses to forces (n, h), of K + sigma M.
        held: V of the held body, (n, r).

    Collective.
    """
    operators, rows = body.operators, held_rows(body)
    if not len(rows):
        return None
    responses = respond(rows.T)
    flexibility = operators.sum(rows @ responses)
    lengths = np.sqrt(np.diagonal(flexibility))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    stiffness = np.linalg.pinv(flexibility / np.outer(lengths, lengths), rcond=INDEPENDENT, hermitian=True)
    shapes = responses @ (stiffness / np.outer(lengths, lengths))
    images = operators.apply_mass(shapes), operators.apply_stiffness(shapes)
    mass, elastic = (operators.sum(np.ascontiguousarray(held.T @ image)).T for image in images)
    traced = np.zeros((contact.interface.size, len(rows)))
    traced[contact.interface.slots] = shapes[contact.interface.owned]
    everywhere = operators.sum(traced)
    return HoldingShapes(
        mass=np.ascontiguousarray(mass),
        stiffness=np.ascontiguousarray(elastic),
        patterns=operators.sum(np.array([shapes.T @ pattern for pattern in body.patterns]).T.copy()),
        pressure=np.ascontiguousarray((contact.resultants.T @ everywhere).T),
        friction=np.ascontiguousarray((contact.friction_resultants.T @ everywhere).T),
    )


def held(body: Body, basis: Basis, shift: float) -> Basis:
    """Return the basis of the held body, in its modal coordinates; the same where no joint holds anything.

    Args:
        body: The body.
        basis: V, with V^T M V = 1 and V^T K V = diag(s).
        shift: sigma > 0, 1/s^2, about the square of the lowest angular frequency.

    Collective.
    """
    rows = held_rows(body)
    if not len(rows):
        return basis
    motions = basis.project(body.operators, rows.T).T
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
