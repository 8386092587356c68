"""Modes and factors of large systems, on small chains with closed forms and against SciPy."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from gapbeam.solver.system import dense_operators
from gapbeam.solver.system.dense_operators import LargeFactor, SparseFactor, SparseOperators, lowest_modes_by_blocks


def chain(count: int, is_free: bool) -> np.ndarray:
    """Return the stiffness of unit masses on unit springs, held at both ends or free."""
    K = 2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    if is_free:
        K[0, 0] = K[-1, -1] = 1.0
    return K


@pytest.mark.parametrize("is_free", [False, True])
def test_modes_of_two_equal_chains_come_in_pairs(is_free: bool) -> None:
    """Squares 4 sin^2, each twice, rigid motions included; shapes are orthonormal and have small residuals."""
    n, heavy, shift, count = 150, 3.0, 1e-6, 20
    K = sl.block_diag(chain(n, is_free), chain(n, is_free))
    inverse = np.linalg.inv(K + shift * heavy * np.eye(2 * n))
    squares, shapes = lowest_modes_by_blocks(lambda b: inverse @ b, lambda x: heavy * x, 2 * n, shift, count)
    k = np.arange(count // 2) if is_free else np.arange(1, count // 2 + 1)
    wanted = np.repeat(4.0 / heavy * np.sin(0.5 * np.pi * k / (n if is_free else n + 1)) ** 2, 2)
    assert np.abs(squares - wanted).max() < 1e-9 * wanted.max()
    assert np.abs(heavy * shapes.T @ shapes - np.eye(count)).max() < 1e-12
    assert np.abs(K @ shapes - heavy * shapes * squares).max() < 1e-8


@pytest.mark.skipif(find_spec("petsc4py") is None, reason="PETSc is optional")
def test_a_large_factor_solves_as_numpy_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """One right side, several at once and none; large operators take it, and have the modes of small ones."""
    A = chain(40, False) + np.eye(40)
    right = np.random.default_rng(1).standard_normal((40, 3))
    factor = LargeFactor(sp.csc_matrix(A))
    assert factor.solve(right) == pytest.approx(np.linalg.solve(A, right), rel=1e-12)
    assert factor.solve(right[:, 0]) == pytest.approx(np.linalg.solve(A, right[:, 0]), rel=1e-12)
    assert factor.solve(right[:, :0]).shape == (40, 0)
    operators = SparseOperators(sp.identity(40), sp.csr_matrix(A))
    small = operators.lowest_modes(0.1, 5, operators.factor(0.1, 1.0))
    monkeypatch.setattr(dense_operators, "LARGE", 10)
    large = operators.lowest_modes(0.1, 5, operators.factor(0.1, 1.0))
    assert isinstance(operators.factor(0.1, 1.0), SparseFactor)
    assert large[0] == pytest.approx(small[0], rel=1e-12)
    assert np.abs(large[1].T @ small[1]) == pytest.approx(np.eye(5), abs=1e-9)
