"""The cross-section of a meshed body: its area and second moment of area, on average along the beam."""

from __future__ import annotations

import math
from dataclasses import dataclass

import basix
import numpy as np
import numpy.typing as npt

from gapbeam.meshes.tagged_mesh import TaggedMesh
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, geometry_order

Array = npt.NDArray[np.float64]

DEGREE = 6
"""Degree of quadrature: exact for the second moment of straight cells, close to it for curved ones."""


@dataclass(frozen=True)
class Section:
    """Volume and second moment of area of a meshed body.

    Attributes:
        volume: V = int dV, m^3.
        area: V / length, m^2.
        second_moment: int (h - h_m)^2 dV / length about the mean height h_m, m^4; h is measured along the bending axis.
    """

    volume: float
    area: float
    second_moment: float


def mean_section(tagged: TaggedMesh, width: float) -> Section:
    """Integrate over the cells of a mesh.

    Args:
        tagged: The mesh.
        width: Factor of all integrals: the width of the beam in 2D, 1 in 3D, m.

    Returns:
        The same figures on all ranks.

    Collective.
    """
    mesh, dimension = tagged.mesh, tagged.dimension
    cells = mesh.topology.index_map(dimension).size_local
    nodes = mesh.geometry.x[coordinate_dofs(mesh)[:cells]][:, :, :dimension]
    cell = mesh.basix_cell()
    variant = basix.LagrangeVariant.equispaced  # where DOLFINx puts the nodes of a geometry
    element = basix.create_element(basix.ElementFamily.P, cell, geometry_order(mesh), variant)
    points, weights = basix.make_quadrature(cell, DEGREE)
    values = element.tabulate(1, points)[..., 0]
    moments = np.zeros(3)
    for value, gradients, weight in zip(values[0], np.moveaxis(values[1:], 1, 0), weights, strict=True):
        volume = weight * np.abs(determinant(np.einsum("kn,cnd->ckd", gradients, nodes)))
        height = nodes[:, :, -1] @ value
        moments += [math.fsum(volume * height**power) for power in range(3)]
    parts = mesh.comm.allgather(moments)
    zeroth, first, second = (width * math.fsum(part[power] for part in parts) for power in range(3))
    length = tagged.upper[0] - tagged.lower[0]
    return Section(zeroth, zeroth / length, (second - first**2 / zeroth) / length)


def determinant(matrices: Array) -> Array:
    """Return determinants, (...), of (..., n, n), n at most 3: products, whose digits are the same at every size.

    The determinant of NumPy goes through logarithms, which are not.
    """
    if matrices.shape[-1] == 1:
        return np.asarray(matrices[..., 0, 0])
    first, second = matrices[..., 0, :], matrices[..., 1, :]
    if matrices.shape[-1] == 2:
        return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    return np.asarray(np.sum(first * np.cross(second, matrices[..., 2, :]), axis=-1))
