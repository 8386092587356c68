"""Expansion from a basis of beam elements to the nodes of a mesh, as a product that is never multiplied out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class ProductExpansion:
    """E V, from reduced DOFs to those of the nodes.

    Attributes:
        nodes: E, from the DOFs of beam elements to those of the nodes, (N, n).
        columns: V, from reduced DOFs to those of beam elements, (n, r).
    """

    nodes: csr_matrix
    columns: csr_matrix

    @property
    def shape(self) -> tuple[int, int]:
        """(N, r)."""
        return int(self.nodes.shape[0]), int(self.columns.shape[1])

    def __matmul__(self, x: Array | csr_matrix) -> Any:
        """Return E V x, or the expansion in terms of other DOFs where x is sparse."""
        if isinstance(x, csr_matrix):
            return ProductExpansion(self.nodes, csr_matrix(self.columns @ x))
        return np.asarray(self.nodes @ (self.columns @ x))

    def __getitem__(self, rows: Any) -> csr_matrix:
        """Return some rows of E V."""
        return csr_matrix(self.nodes[rows] @ self.columns)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Return E V multiplied out, (N, r)."""
        return np.asarray((self.nodes @ self.columns).toarray(), dtype=dtype)


@dataclass(frozen=True)
class HoldingShapes:
    """Products with the shapes Z that move h held motions by one each; V is the basis of the held body.

    Attributes:
        mass: Z^T M V, (h, n).
        stiffness: Z^T K V, the restraint included, (h, n).
        patterns: Z^T of `Body.patterns`, (h, patterns).
        pressure: Z^T H^T: what forces at the m contact points do along Z, (h, m).
        friction: Z^T T^T: what friction forces there do, (h, m k); without columns where there is no friction.
    """

    mass: Array
    stiffness: Array
    patterns: Array
    pressure: Array
    friction: Array
