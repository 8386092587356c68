"""The truncation check: the share of the contact faces' static flexibility that a basis misses.

Under a pressure z the faces give way by z^T D z, D = G (K + sigma M)^-1 G^T. A basis gives less,

    sum_j (phi_j^T G^T z)^2 / (s_j + sigma).

The share of what is missing, rigid motions left out, is averaged over random pressures.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.system.operators import Array, Factor, Operators
from gapbeam.solver.system.semi_discrete import ContactOperator

RIGID = 0.5  # of the shift; modes below are motions of the floating body on its weak restraint


def neglected_shares(
    operators: Operators, contact: ContactOperator, factor: Factor, basis: Basis, shift: float, pressures: list[Array]
) -> list[float]:
    """Return the shares of the flexibility that a basis misses, at least 0, one for each set of pressures.

    Args:
        operators: M and K.
        contact: The contact points.
        factor: The factor of K + sigma M.
        basis: V and its frequencies.
        shift: sigma, 1/s^2.
        pressures: Sets of pressures at the contact points, columns (m, k).

    Collective.
    """
    missing, elastic = flexibilities(operators, contact, factor, basis, shift, np.concatenate(pressures, axis=1))
    ends = np.cumsum([columns.shape[1] for columns in pressures])[:-1]
    return [
        max(float(missed.sum() / whole.sum()), 0.0) if whole.sum() > 0.0 else 0.0
        for missed, whole in zip(np.split(missing, ends), np.split(elastic, ends), strict=True)
    ]


def flexibilities(
    operators: Operators, contact: ContactOperator, factor: Factor, basis: Basis, shift: float, pressures: Array
) -> tuple[Array, Array]:
    """Return z^T D z less what a basis gives, and z^T D z, both without rigid motions, (k,), J.

    Args:
        operators: M and K.
        contact: The contact points.
        factor: The factor of K + sigma M.
        basis: V and its frequencies.
        shift: sigma, 1/s^2.
        pressures: At the contact points, (m, k), Pa.

    Collective.
    """
    interface = contact.interface
    loads = np.asarray(contact.resultants @ (contact.weights[:, None] * pressures))
    moved = factor.solve_columns(interface, csr_matrix(loads))
    forces = loads[interface.slots]
    full = operators.sum(np.einsum("ij,ij->j", moved[interface.owned], forces))
    shares = operators.sum(np.ascontiguousarray(basis.columns[interface.owned].T @ forces)) ** 2
    flexibility = shares / (basis.squares + shift)[:, None]
    rigid = flexibility[basis.squares < RIGID * shift].sum(axis=0)
    return full - flexibility.sum(axis=0), full - rigid


def random_pressures(contact: ContactOperator, count: int, shapes: Array | None = None) -> Array:
    """Return random pressures, (m, count), always the same: from point to point, or of random sizes of given shapes."""
    random = np.random.default_rng(0)
    if shapes is None:
        return np.asarray(random.choice([-1.0, 1.0], (contact.size, count)))
    return np.asarray(shapes @ random.choice([-1.0, 1.0], (shapes.shape[1], count)))
