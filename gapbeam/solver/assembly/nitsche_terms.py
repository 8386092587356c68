"""Nitsche's method for unilateral contact: no penalty, the contact pressure is the stress of the body.

    p = gamma <d - sigma_n(u) / gamma>,    a(u, v) - int theta/gamma sigma_n(u) sigma_n(v)
                                           - int p (G v + theta/gamma sigma_n(v)) = l(v)

With S the operator of the normal stress at the contact points this is penalty contact with other operators:
G_N = G + S/gamma, H_N = G + theta S/gamma and K_N = K - theta S^T (w/gamma) S, stiffness gamma. The method is
consistent: gamma need not go to infinity. theta = 1 is symmetric (it has a potential, so that discrete gradients and
energy balances work), 0 incomplete, -1 skew.

gamma has to exceed (1 + theta)^2 / 4 of the largest eigenvalue of the trace problem on each contact cell,

    int_facets sigma_n(u)^2 <= lambda int_cell sigma(u) : eps(u)     for all u,

over all its contact facets; it is computed here, cell by cell, instead of guessed. Above that the problem is strongly
monotone, and has one solution: for every gamma where theta = -1.

sigma_n is the force on the face along the bending axis per projected area, e . sigma n / (e . n): faces that are
not flat are met along that axis without friction.

Source: Chouly, Hild and Renard (2015), Math. Comp. 84, 1089-1112.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs
from gapbeam.solver.assembly.cell_stiffness import CellStiffness
from gapbeam.solver.assembly.face_quadrature import FacePoints
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array

RIGID_MOTIONS = {2: 3, 3: 6}


@dataclass(frozen=True)
class Nitsche:
    """Settings of Nitsche's method.

    Attributes:
        theta: 1, 0 or -1.
        factor: gamma relative to the eigenvalue of the trace problem.
        lame: (lambda, mu), Pa; in plane stress the reduced lambda.
        width: Factor of the cell integrals in 2D, 1 in 3D, m.
    """

    theta: float
    factor: float
    lame: tuple[float, float]
    width: float

    def __post_init__(self) -> None:
        """Refuse a gamma for which the problem need not have a solution."""
        least = 0.25 * (1.0 + self.theta) ** 2
        if self.factor <= least:
            raise UserError(
                f"contact.formulation: found factor = {self.factor:g}; nitsche with theta = {self.theta:g} needs more "
                f"than {least:g}, and 2 is enough for every theta"
            )


def stress_rows(points: FacePoints, lame: tuple[float, float]) -> Array:
    """Return the normal stress at the points per unit nodal displacement, (m, k, dimension), Pa/m.

    sigma_n = lambda div u + mu (du_e/dn + n . du/de) along the bending axis e, the last one, with n . e = 1.
    """
    first, second = lame
    rows: Array = first * points.gradients
    rows[..., -1] += second * np.einsum("qkx,qx->qk", points.gradients, points.normals)
    rows += second * points.gradients[..., -1:] * points.normals[:, None, :]
    return rows


def trace_bounds(space: Any, faces: Mapping[str, FacePoints], settings: Nitsche) -> dict[int, float]:
    """Return the eigenvalue of the trace problem of every contact cell, Pa/m, by global cell number.

    Args:
        space: Blocked vector Lagrange space.
        faces: Points of each face on this rank.
        settings: Material and width.

    Collective.
    """
    mesh = space.mesh
    first_cell = mesh.topology.index_map(mesh.topology.dim).local_range[0]
    joined = FacePoints.join(list(faces.values()))  # a cell may have facets of both faces
    rows = np.sqrt(joined.weights)[:, None, None] * stress_rows(joined, settings.lame)
    cells = np.unique(joined.cells)
    first, second = (np.full(len(coordinate_dofs(mesh)), modulus) for modulus in settings.lame)
    stiffness = CellStiffness(space, first, second, settings.width).of_cells(cells - first_cell)
    bounds: dict[int, float] = {}
    for cell, of_cell in zip(cells, stiffness, strict=True):
        mine = joined.cells == cell
        values, vectors = np.linalg.eigh(of_cell)
        elastic = slice(RIGID_MOTIONS[mesh.topology.dim], None)
        scaled = rows[mine].reshape(np.count_nonzero(mine), -1) @ vectors[:, elastic] / np.sqrt(values[elastic])
        bounds[int(cell)] = float(np.linalg.norm(scaled, 2) ** 2)
    return {cell: bound for part in mesh.comm.allgather(bounds) for cell, bound in part.items()}


def correction(stress: csr_matrix, weights: Array, gamma: Array, theta: float) -> csr_matrix:
    """Return -theta S^T (w/gamma) S on the interface DOFs, N/m."""
    return csr_matrix(-theta * (stress.T @ stress.multiply((weights / gamma)[:, None])))
