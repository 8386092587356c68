"""A dense system in modal coordinates, where M = 1 and K is diagonal: the form that the compiled march takes.

    q'' + C q' + s q = sum_k s_k(t) L_k + Phi^T f,    d = -(g0 + Phi q),    x = X q,    Phi = G X

with X^T M X = 1, X^T K X = diag(s) and C = diag(c_M + c_K s) + sum_j c_j beta_j beta_j^T, the dashpots. A time step
without contact is then a handful of products per DOF.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, RankOnes, row_product
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem

ROUND_OFF = 1.0e-13  # of the largest eigenvalue
ALONE = 1.0e-8  # of the largest entry: what round-off of the modes leaves at other modes


@dataclass(frozen=True)
class ModalSystem:
    """A system with M = 1, K = diag(s), C = c_M + c_K s and dashpots.

    Attributes:
        system: The dense system that this is.
        shapes: X, from modal coordinates to the DOFs of the system, (n, n).
        squares: s, squares of the angular frequencies, (n,), 1/s^2.
        gaps: Phi, (m, n).
        loads: L_k = X^T f_k, (loads, n).
        dashpots: beta_j = X^T b_j and c_j, (k, n) and (k,); k = 0 without dashpots.
        modal_damping: Damping by dashpots that damp one mode each, (n,), 1/s; they are not among `dashpots`.
    """

    system: SemiDiscreteSystem
    shapes: Array
    squares: Array
    gaps: Array
    loads: Array
    dashpots: RankOnes
    modal_damping: Array

    @property
    def damping(self) -> Array:
        """C without the dashpots, (n,), 1/s."""
        rayleigh = self.system.mass_damping + self.system.stiffness_damping * self.squares
        return np.asarray(rayleigh + self.modal_damping)

    @cached_property
    def tangents(self) -> Array:
        """T X, the motion of the contact points along the faces, (m, k, n); for operators with tangents."""
        contact = self.system.contact
        assert contact.tangents is not None
        moved = contact.tangents @ traced_on(contact, self.shapes)
        return np.ascontiguousarray(moved.reshape(contact.size, -1, len(self.squares)))

    @cached_property
    def planes(self) -> Array:
        """The motions of the axes of stations in round holes, (k, 2, n)."""
        contact, circles = self.system.contact, self.system.contact.circles
        moved = circles.plane @ traced_on(contact, self.shapes)
        return np.ascontiguousarray(moved.reshape(-1, 2, len(self.squares)))

    @cached_property
    def surfaces(self) -> Array:
        """The motions of the surfaces of these stations, (k, 4, n); for operators with tangents."""
        contact, circles = self.system.contact, self.system.contact.circles
        assert circles.surface is not None
        moved = circles.surface @ traced_on(contact, self.shapes)
        return np.ascontiguousarray(moved.reshape(-1, 4, len(self.squares)))

    @cached_property
    def restraint(self) -> Array:
        """Y, (n, r), with X^T K_restraint X = Y Y^T: the weak restraint in K, of rank r, 1/s."""
        operators = self.system.operators
        assert isinstance(operators, DenseOperators)
        return _root(self.shapes.T @ operators.restraint @ self.shapes)

    @cached_property
    def _columns(self) -> Array:
        """X^T, row by row."""
        return np.ascontiguousarray(self.shapes.T)

    def coordinates(self, x: Array) -> Array:
        """Return q = X^T M x, (n,), of DOFs x, (n,)."""
        return np.asarray(self.shapes.T @ self.system.operators.apply_mass(x))

    def dofs(self, q: Array) -> Array:
        """Return X q; q is (n,) or, row by row, (times, n)."""
        return np.asarray(q @ self.shapes.T) if q.ndim == 1 else row_product(q, self._columns)


def modal_system(system: SemiDiscreteSystem) -> ModalSystem | None:
    """Return a dense system in modal coordinates; None where it is not dense, has massless DOFs, or H is not G."""
    operators, contact = system.operators, system.contact
    if not isinstance(operators, DenseOperators) or np.any(operators.massless) or not contact.symmetric:
        return None
    squares, shapes = operators.modes
    dashpots = system.dashpots or RankOnes(np.zeros((0, operators.size)), np.zeros(0))
    dashpots, modal_damping = _by_modes(RankOnes(dashpots.patterns @ shapes, dashpots.coefficients))
    return ModalSystem(
        system,
        shapes,
        np.maximum(squares, 0.0),
        np.ascontiguousarray(contact.gap_matrix @ traced_on(contact, shapes)),
        np.array([load.pattern @ shapes for load in system.loads]).reshape(len(system.loads), operators.size),
        dashpots,
        modal_damping,
    )


def _root(matrix: Array) -> Array:
    """Return Y, (n, r), with matrix = Y Y^T, of a symmetric one without negative eigenvalues up to round-off."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    kept = values > ROUND_OFF * values.max(initial=0.0)
    return np.ascontiguousarray(vectors[:, kept] * np.sqrt(values[kept]))


def _by_modes(dashpots: RankOnes) -> tuple[RankOnes, Array]:
    """Return the dashpots that couple modes, and the contribution of the others to the damping of each mode, (n,), 1/s.

    Modal damping is one dashpot for each mode, and joints without dampers are dashpots of nothing: as rank-one updates
    they would cost a step more than all the rest.
    """
    patterns, coefficients = dashpots.patterns, dashpots.coefficients
    sizes = np.abs(patterns)
    largest = sizes.max(axis=1, initial=0.0)
    alone = (sizes > ALONE * largest[:, None]).sum(axis=1) <= 1
    own, damping = alone & (coefficients != 0.0), np.zeros(patterns.shape[1])
    np.add.at(damping, sizes[own].argmax(axis=1), coefficients[own] * largest[own] ** 2)
    coupled = ~alone & (coefficients != 0.0)
    return RankOnes(np.ascontiguousarray(patterns[coupled]), coefficients[coupled]), damping


def traced_on(contact: ContactOperator, shapes: Array) -> Array:
    """Return shapes, (n, r), on the interface DOFs of a dense system, (interface.size, r)."""
    interface = contact.interface
    traced = np.zeros((interface.size, shapes.shape[1]))
    traced[interface.slots] = shapes[interface.owned]
    return traced
