"""Deflation against dense algebra, and on a beam: round-off of K does not change smooth forces and momenta."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.elasticity import CellStiffness
from gapbeam.solver.linear_algebra.mumps_factor import DeflatedFactor
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.linear_algebra.smooth_modes import Deflation
from gapbeam.solver.system.operators import Array, Interface
from tests.shared.models import SOLID, beam_model

pytestmark = pytest.mark.versions

MASS, STIFFNESS = 2.0e4, 5.0e-5  # of a step of 0.1 ms


def deflated(scale: float = 1.0) -> tuple[Array, Deflation]:
    """Return A, (20, 20), symmetric positive definite for `scale` > 0, and the deflation of four vectors."""
    random = np.random.default_rng(7)
    basis = np.linalg.qr(random.standard_normal((20, 4)))[0]
    rest = np.eye(20) - basis @ basis.T
    stiff = random.standard_normal((20, 20))
    matrix = (
        rest @ (stiff @ stiff.T) @ rest + scale * basis @ np.diag([1.0, 2.0, 3.0, -4.0 if scale < 0 else 4.0]) @ basis.T
    )
    coupled = 1.0e-2 * rest @ random.standard_normal((20, 4)) @ basis.T
    matrix += coupled + coupled.T
    return matrix, Deflation(basis, matrix @ basis, lambda local: local)


class _WrongFactor:
    """Solves by a matrix that is wrong by half on the basis, as a factor without digits there."""

    tolerance = 0.0

    def __init__(self, matrix: Array) -> None:
        self.inverse = np.linalg.inv(matrix)

    def solve(self, right_side: Array) -> Array:
        return np.asarray(self.inverse @ right_side)

    def solve_columns(self, interface: Interface, columns: csr_matrix) -> Array:
        spread = np.zeros((len(self.inverse), columns.shape[1]))
        spread[interface.owned] = columns[interface.slots].toarray()
        return np.asarray(self.inverse @ spread)

    def keeps(self, columns: int) -> bool:
        return columns > 0

    def interface_block(self, interface: Interface) -> Array | None:
        return self.inverse[np.ix_(interface.owned, interface.owned)]


def test_a_factor_that_is_wrong_on_the_basis_gives_a_symmetric_solver() -> None:
    """The solver is symmetric and exact for forces A Z; a correction of the answer alone is not symmetric."""
    matrix, deflation = deflated()
    basis = deflation.basis
    wrong = _WrongFactor(matrix - 0.5 * basis @ (basis.T @ matrix @ basis) @ basis.T)
    interface = Interface(20, np.arange(20), np.arange(20))
    solver = DeflatedFactor.symmetric(wrong, deflation)
    columns = solver.solve_columns(interface, csr_matrix(np.eye(20)))
    assert columns == pytest.approx(columns.T, abs=1e-12 * np.abs(columns).max())
    assert np.column_stack([solver.solve(one) for one in np.eye(20)]) == pytest.approx(columns, rel=1e-9, abs=1e-12)
    assert columns @ deflation.images == pytest.approx(basis, abs=1e-11)
    assert solver.interface_block(interface) is None
    one_sided = DeflatedFactor(wrong, deflation).solve_columns(interface, csr_matrix(np.eye(20)))
    assert np.abs(one_sided - one_sided.T).max() > 1e-6 * np.abs(one_sided).max()


@pytest.mark.parametrize("shape", [(20,), (20, 3)])
def test_products_are_exact_where_the_matrix_is_wrong_on_the_basis(shape: tuple[int, ...]) -> None:
    matrix, deflation = deflated()
    basis = deflation.basis
    wrong = matrix + basis @ np.full((4, 4), 1.0e3) @ basis.T
    x = np.random.default_rng(8).standard_normal(shape)
    assert deflation.product(lambda y: wrong @ y)(x) == pytest.approx(matrix @ x, rel=1e-12, abs=1e-12)
    assert np.abs(wrong @ x - matrix @ x).max() > 1.0


@pytest.mark.parametrize("scale", [1.0, -1.0], ids=["positive definite", "indefinite on the basis"])
def test_two_level_preconditioner(scale: float) -> None:
    """Q + (1 - Q A) B (1 - A Q), Q = Z (Z^T A Z)^-1 Z^T, as matrices; exact for right sides A Z."""
    matrix, deflation = deflated(scale)
    basis = deflation.basis
    inner = np.diag(np.linspace(0.5, 2.0, 20))
    coarse = basis @ np.linalg.inv(basis.T @ matrix @ basis) @ basis.T
    left = np.eye(20) - coarse @ matrix
    applied = deflation.preconditioner(lambda y: inner @ y)(np.eye(20))
    assert applied == pytest.approx(coarse + left @ inner @ left.T, rel=1e-11, abs=1e-11)
    assert applied @ deflation.images == pytest.approx(basis, abs=1e-11)


def operators_of(mesh: dict[str, Any]) -> PetscOperators:
    operators = beam_model({"mesh": mesh}).system.operators
    assert isinstance(operators, PetscOperators)
    return operators


def plain_product(operators: PetscOperators, x: Array) -> Array:
    matrix = operators.matrices()[1]
    moved, force = matrix.createVecs()
    moved.array[:] = x
    matrix.mult(moved, force)
    return np.array(force.array_r)


def rounded_otherwise(matrix: PETSc.Mat) -> PETSc.Mat:
    """Return a symmetric matrix whose entries are up to an eps larger or smaller."""
    starts, columns, values = matrix.getValuesCSR()
    noise = csr_matrix((np.random.default_rng(4).uniform(-1.0, 1.0, len(values)), columns, starts), matrix.getSize())
    noise = csr_matrix(0.5 * (noise + noise.T))
    matrix.setValuesCSR(starts, columns, values * (1.0 + np.finfo(float).eps * noise.data))
    matrix.assemble()
    return matrix


@pytest.mark.parametrize("mesh", [{}, SOLID], ids=["2D", "3D"])
def test_round_off_of_the_stiffness_does_not_change_smooth_forces(
    mesh: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Matrices that are rounded otherwise: smooth forces and momenta change by a 50th of what they would, or less.

    A beam displaced, turned and bent; against the product and the factor of the whole matrix.
    """
    one = operators_of(mesh)
    sum_cells = CellStiffness.add_to

    def add_rounded(cells: CellStiffness, matrix: PETSc.Mat) -> None:
        sum_cells(cells, matrix)
        rounded_otherwise(matrix)

    monkeypatch.setattr(CellStiffness, "add_to", add_rounded)
    other = operators_of(mesh)
    assert one.smooth is not None
    shapes = one.smooth.basis
    np.testing.assert_allclose(shapes.T @ shapes, np.eye(shapes.shape[1]), atol=1e-12)
    moved = shapes[:, :3].sum(axis=1)

    def smooth(x: Array) -> float:
        return float(np.abs(shapes[:, :3].T @ x).max())

    plain = smooth(plain_product(one, moved) - plain_product(other, moved))
    assert smooth(one.apply_stiffness(moved) - other.apply_stiffness(moved)) < 0.02 * plain
    np.testing.assert_allclose(
        one.apply_stiffness(moved), plain_product(one, moved), atol=1e-12 * one.matrices()[1].getDiagonal().max()[1]
    )
    force = MASS * one.apply_mass(moved) + STIFFNESS * one.apply_stiffness(moved)
    factors = [operators.factor(MASS, STIFFNESS) for operators in (one, other)]
    assert all(isinstance(factor, DeflatedFactor) for factor in factors)
    changes = [factor.solve(force) - moved for factor in factors]
    plain_changes = [factor.factor.solve(force) - moved for factor in factors]  # type: ignore[attr-defined]
    assert max(map(smooth, changes)) < 0.05 * max(map(smooth, plain_changes))  # 0.023 on one processor
