"""Smooth motions do not feel round-off of K: neither products nor solves change with its last digits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from petsc4py import PETSc
from scipy.sparse import csr_matrix

import solver.petsc_operators as module
from solver.corrected_factor import CorrectedFactor
from solver.operators import Array
from solver.petsc_operators import PetscOperators
from tests.models import SOLID, beam_model

MASS, STIFFNESS = 2.0e4, 5.0e-5  # of a step of 0.1 ms


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
def test_smooth_motions_do_not_feel_round_off_of_the_stiffness(
    mesh: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Matrices that are rounded otherwise: smooth forces and momenta change by a 50th of what they would, or less.

    A beam displaced, turned and bent; against the product and the factor of the whole matrix.
    """
    one = operators_of(mesh)
    assemble = module._assemble
    monkeypatch.setattr(module, "_assemble", lambda form: rounded_otherwise(assemble(form)))
    other = operators_of(mesh)
    assert one.smooth is not None
    shapes = one.smooth.shapes
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
    assert all(isinstance(factor, CorrectedFactor) for factor in factors)
    changes = [factor.solve(force) - moved for factor in factors]
    plain_changes = [factor.factor.solve(force) - moved for factor in factors]  # type: ignore[attr-defined]
    assert max(map(smooth, changes)) < 0.02 * max(map(smooth, plain_changes))
