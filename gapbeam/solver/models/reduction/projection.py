"""A finite element body in terms of a basis, u = V q: operators, contact, loads and probes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.attached_motions import attached_rows
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.loads.load_parts import patterned
from gapbeam.solver.models.body import Body, ProbeRow
from gapbeam.solver.models.expansion import ProductExpansion
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface, Operators
from gapbeam.solver.system.ordered_products import row_product
from gapbeam.solver.system.semi_discrete import ContactOperator

Kept = NDArray[np.bool_]

UNMOVED = 1.0e-8  # of the largest motion that a unit force gives a mode


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
    return replace(
        body,
        operators=DenseOperators(np.identity(size), elastic, 0.5 * (held + held.T)),
        contact=_in_terms_of(contact, everywhere, trace),
        patterns=tuple(basis.project(operators, pattern) for pattern in body.patterns),
        probes={name: _dense_row(probe, basis, operators) for name, probe in body.probes.items()},
        rigid=np.stack([basis.project(operators, row) for row in body.rigid]),
        expansion=_expanded(body, basis),
    )


def _expanded(body: Body, basis: Basis) -> Array | ProductExpansion:
    """Return what takes reduced DOFs to those of the mesh."""
    if body.expansion is None:
        return basis.columns
    if isinstance(body.expansion, csr_matrix):
        return ProductExpansion(body.expansion, basis.columns)
    return np.asarray(body.expansion @ basis.columns)


def moved(body: Body, contact: ContactOperator, basis: Basis) -> Kept:
    """Return which columns of a basis loads or contact can move, (r,): those that are symmetric. Collective."""
    operators = body.operators
    trace = _trace(operators, contact.interface, basis)
    gaps = np.sqrt(contact.weights[:, None]) * (contact.gap_matrix @ trace)
    touched = np.linalg.norm(gaps, axis=0)
    found: Kept = touched > UNMOVED * touched.max()
    # a basis does not move where a joint holds it: what is left there is round-off
    free = [row for one, row in attached_rows(body.case, body.patterns) if not one.held]
    for pattern in (*body.patterns[: len(patterned(body.case.load))], *free):
        force = basis.project(operators, pattern)
        found |= np.abs(force) > UNMOVED * np.abs(force).max()
    return found


def _trace(operators: Operators, interface: Interface, basis: Basis) -> Array:
    """Return the interface values of a basis on every rank, (interface.size, r). Collective."""
    values = np.zeros((interface.size, len(basis.squares)))
    values[interface.slots] = basis.columns[interface.owned]
    return operators.sum(values)


def _dense_row(probe: ProbeRow, basis: Basis, operators: Operators) -> DenseRow:
    columns = [probe.evaluate(np.ascontiguousarray(column), operators) for column in basis.columns.T]
    return DenseRow(np.stack(columns, axis=1))


def _in_terms_of(contact: ContactOperator, interface: Interface, trace: Array) -> ContactOperator:
    """Return an operator on reduced DOFs whose interface values are `trace` q."""
    tangents = None if contact.tangents is None else _sparse(contact.tangents @ trace)
    moved = replace(contact, interface=interface, gap_matrix=_sparse(contact.gap_matrix @ trace), tangents=tangents)
    if isinstance(moved, ResultantOperator):
        return replace(moved, distributed=_in_terms_of(moved.distributed, interface, trace))
    return moved


def _sparse(filled: Array) -> csr_matrix:
    """Return rows that are mostly filled, without the zeros that planes which do not meet leave."""
    kept = filled != 0.0
    starts = np.concatenate([[0], np.cumsum(np.count_nonzero(kept, axis=1))])
    columns = np.broadcast_to(np.arange(filled.shape[1], dtype=np.int32), filled.shape)[kept]
    return csr_matrix((filled[kept], columns, starts), filled.shape)
