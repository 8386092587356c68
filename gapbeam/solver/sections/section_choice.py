"""Cross-sections: `section` of [beam], by name or as a table with its `type`, with the I and the hollow rectangle.

The torsion constant of sections of rectangular blocks, by finite elements for the warping function.

A section that twists by theta' per length moves along the beam by theta' phi(y, z), phi the warping function. Of all
functions it makes smallest

    J = int (phi_y - z)^2 + (phi_z + y)^2 dA

so that the figure found is a bit too large. Of sections that are symmetric about both axes a quarter is enough, with
phi = 0 on both axes. Elements are biquadratic. They shrink toward the corner where blocks meet, at which the shear
stress grows without bound, and toward the ends of flanges and walls. What is left is an error of some 1e-5 of J.

Source: Timoshenko and Goodier (1970), Theory of Elasticity, 3rd ed., sec. 104.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field

from gapbeam.meshes.sections.section_patches import SectionPatches, grid_patches
from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.schema.table import OF_TYPE, Positive
from gapbeam.solver.sections.polygon_section import PolygonSection
from gapbeam.solver.sections.section_table import (
    RectangularSection,
    RoundSection,
    SymmetricSection,
    TubeSection,
    solid_shear,
    thin_enough,
    thin_walled_shear,
    wall_cells,
)

RATIO = 0.6  # of the lengths of neighboring elements
INWARD, OUTWARD = 18, 10  # elements toward the corner where blocks meet, and toward the outer faces
POINTS = 0.5 + 0.5 * np.polynomial.legendre.leggauss(3)[0]
WEIGHTS = 0.5 * np.polynomial.legendre.leggauss(3)[1]

Array = NDArray[np.float64]
Blocks = tuple[tuple[bool, bool], tuple[bool, bool]]
"""Presence of the blocks: by y (inner, outer), and in that by z (inner, outer)."""


@lru_cache(maxsize=256)
def torsion_of_blocks(corner: tuple[float, float], outer: tuple[float, float], blocks: Blocks) -> float:
    """Return J of a section whose quarter y, z > 0 consists of rectangular blocks, m^4.

    Args:
        corner: (y, z) of the corner where the blocks meet, m.
        outer: (y, z) of the outer corner, m.
        blocks: Whether each of the four blocks is filled.
    """
    lines = [_graded(inner, end) for inner, end in zip(corner, outer, strict=True)]
    sizes = [np.diff(line) for line in lines]
    block = [np.asarray(line[:-1] >= at, dtype=int) for line, at in zip(lines, corner, strict=True)]
    first, second = np.nonzero(np.array(blocks)[np.ix_(*block)])
    y, z = (
        line[of][:, None] + size[of][:, None] * POINTS
        for line, size, of in zip(lines, sizes, (first, second), strict=True)
    )
    shapes, slopes = _shapes(POINTS)
    by_y = np.einsum("ai,bj->abij", slopes, shapes).reshape(len(POINTS), len(POINTS), -1)
    by_z = np.einsum("ai,bj->abij", shapes, slopes).reshape(len(POINTS), len(POINTS), -1)
    long, high = sizes[0][first], sizes[1][second]
    weights = np.outer(WEIGHTS, WEIGHTS)
    in_y, in_z = (np.einsum("ab,abi,abj->ij", weights, part, part) for part in (by_y, by_z))
    stiffness = (high / long)[:, None, None] * in_y + (long / high)[:, None, None] * in_z
    force = np.einsum("ab,eb,abi,e->ei", weights, z, by_y, high) - np.einsum("ab,ea,abi,e->ei", weights, y, by_z, long)
    count = 2 * len(sizes[1]) + 1
    local = np.add.outer(np.arange(3) * count, np.arange(3)).reshape(-1)
    nodes = (2 * first * count + 2 * second)[:, None] + local
    free, numbers = np.unique(nodes, return_inverse=True)
    numbers = numbers.reshape(nodes.shape)
    held = (free < count) | (free % count == 0)
    shape = (len(free), len(free))
    rows, columns = np.repeat(numbers, 9, axis=1), np.tile(numbers, 9)
    matrix = scipy.sparse.csc_matrix((stiffness.reshape(-1), (rows.reshape(-1), columns.reshape(-1))), shape)
    right = np.bincount(numbers.reshape(-1), force.reshape(-1), len(free))
    kept = np.flatnonzero(~held)
    warping = scipy.sparse.linalg.spsolve(matrix[np.ix_(kept, kept)], right[kept])
    rigid = np.sum(long * high * ((y**2) @ WEIGHTS + (z**2) @ WEIGHTS))
    return float(4.0 * (rigid - right[kept] @ warping))


def _graded(inner: float, end: float) -> Array:
    """Return the ends of elements from 0 to `end`, which shrink toward `inner` from both sides and toward `end`, m."""
    near, far = RATIO ** np.arange(INWARD), RATIO ** np.arange(1, OUTWARD)
    half = 0.5 * (end - inner)
    return np.concatenate(
        [[0.0], inner * (1.0 - near[1:]), [inner], (inner + half * near)[::-1], end - half * far, [end]]
    )


def _shapes(xi: Array) -> tuple[Array, Array]:
    """Return the quadratic shapes and their slopes at places of [0, 1], (k, 3) each."""
    shapes = np.stack([(1.0 - xi) * (1.0 - 2.0 * xi), 4.0 * xi * (1.0 - xi), xi * (2.0 * xi - 1.0)], axis=1)
    slopes = np.stack([4.0 * xi - 3.0, 4.0 - 8.0 * xi, 4.0 * xi - 1.0], axis=1)
    return shapes, slopes


class ISection(SymmetricSection):
    """Two flanges across the bending plane and a web between them.

    Source: Cowper (1966), table 1, thin-walled I section, for the shear coefficient.
    """

    type: Literal["i"] = Field(description="two flanges, width wide, and a web between them, thickness high in all")
    web: Positive = Field(description="thickness of the web across the bending plane, m", examples=[0.004])
    flange: Positive = Field(description="thickness of each flange in the bending direction, m", examples=[0.003])

    def area(self, thickness: float, width: float) -> float:
        """Return 2 b t_f + (h - 2 t_f) t_w."""
        return 2.0 * width * self.flange + (thickness - 2.0 * self.flange) * self.web

    def second_moment(self, thickness: float, width: float) -> float:
        """Return (b h^3 - (b - t_w) h_w^3) / 12."""
        return (width * thickness**3 - (width - self.web) * (thickness - 2.0 * self.flange) ** 3) / 12.0

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return Cowper's kappa with n = b / h and m = 2 b t_f / (h t_w), h between the middles of the flanges."""
        height, nu = thickness - self.flange, poisson_ratio
        n = width / height
        m = 2.0 * n * self.flange / self.web
        more = 30.0 * n**2 * (m + m**2) + 5.0 * nu * n**2 * (8.0 * m + 9.0 * m**2)
        return thin_walled_shear(m, more, nu)

    def lateral_moment(self, thickness: float, width: float) -> float:
        """Return (2 t_f b^3 + h_w t_w^3) / 12."""
        return (2.0 * self.flange * width**3 + (thickness - 2.0 * self.flange) * self.web**3) / 12.0

    def lateral_shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return the kappa of a rectangle over both flanges, which carry the shear."""
        share = 2.0 * width * self.flange / self.area(thickness, width)
        return share * solid_shear(poisson_ratio)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return J by finite elements; warping is free, as in all torsion here."""
        outer = 0.5 * width, 0.5 * thickness
        return torsion_of_blocks((0.5 * self.web, outer[1] - self.flange), outer, ((True, True), (False, True)))

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:
        """Return three patches in each flange, and the web."""
        y, z = 0.5 * width, 0.5 * thickness
        lines = (-y, -0.5 * self.web, 0.5 * self.web, y), (-z, self.flange - z, z - self.flange, z)
        outer, thin = max(1, across // 2), wall_cells(through)
        full, middle = (True, True, True), (False, True, False)
        return grid_patches(lines, ((outer, wall_cells(across), outer), (thin, through, thin)), (full, middle, full))

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in the web or in a flange."""
        outside = abs(y) > 0.5 * width or abs(z) > 0.5 * thickness
        return not outside and (abs(y) <= 0.5 * self.web or abs(z) >= 0.5 * thickness - self.flange)

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield webs that are as wide as the flanges, and flanges that leave no web."""
        yield from thin_enough("web", self.web, width, "the width of the flanges")
        yield from thin_enough("flange", self.flange, 0.5 * thickness, "half of the thickness of the beam")


class BoxSection(SymmetricSection):
    """A hollow rectangle whose walls are all equally thick.

    Source: Cowper (1966), table 1, thin-walled box section, for the shear coefficient.
    """

    type: Literal["box"] = Field(description="a hollow rectangle, thickness high and width wide")
    wall: Positive = Field(description="thickness of all four walls, m", examples=[0.002])

    def area(self, thickness: float, width: float) -> float:
        """Return b h - b_i h_i."""
        return width * thickness - (width - 2.0 * self.wall) * (thickness - 2.0 * self.wall)

    def second_moment(self, thickness: float, width: float) -> float:
        """Return (b h^3 - b_i h_i^3) / 12."""
        inside = (width - 2.0 * self.wall) * (thickness - 2.0 * self.wall) ** 3
        return (width * thickness**3 - inside) / 12.0

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return Cowper's kappa with m = n = b / h, taken between the middles of the walls."""
        n = (width - self.wall) / (thickness - self.wall)
        more = 10.0 * n**2 * ((3.0 + poisson_ratio) * n + 3.0 * n**2)
        return thin_walled_shear(n, more, poisson_ratio)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return J by finite elements, for walls of any thickness; Bredt's 4 A_m^2 t / s is that of thin ones."""
        outer = 0.5 * width, 0.5 * thickness
        return torsion_of_blocks((outer[0] - self.wall, outer[1] - self.wall), outer, ((False, True), (True, True)))

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:
        """Return four corners and four walls."""
        y, z, wall = 0.5 * width, 0.5 * thickness, self.wall
        lines = (-y, wall - y, y - wall, y), (-z, wall - z, z - wall, z)
        thin = wall_cells(through)
        full, hollow = (True, True, True), (True, False, True)
        return grid_patches(lines, ((thin, across, thin), (thin, through, thin)), (full, hollow, full))

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in a wall."""
        outside = abs(y) > 0.5 * width or abs(z) > 0.5 * thickness
        return not outside and (abs(y) >= 0.5 * width - self.wall or abs(z) >= 0.5 * thickness - self.wall)

    def hollow(self, thickness: float, width: float) -> tuple[float, float]:
        """Return the sizes between the walls."""
        return thickness - 2.0 * self.wall, width - 2.0 * self.wall

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield walls that leave no hollow."""
        yield from thin_enough("wall", self.wall, 0.5 * min(thickness, width), "half of the thickness and of the width")


SectionChoice = Annotated[
    RectangularSection | BoxSection | ISection | PolygonSection | RoundSection | TubeSection,
    OF_TYPE,
]
RECTANGLE = RectangularSection(type="rectangle")
