"""Deflation against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.linear_algebra.iterative.deflation import Deflation
from gapbeam.solver.system.operators import Array


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
