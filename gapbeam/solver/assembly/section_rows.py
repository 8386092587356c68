"""The mean motions of cross-sections of a mesh, as rows of its DOFs, and the forces that work on these motions.

A point on the axis stands for its whole cross-section: it moves as the section carries it on average, and a force there
is distributed over the section. A force at a single node of a solid would sink in without bound as cells get finer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.assembly.point_rows import PointRow, point_row
from gapbeam.solver.assembly.section_cut import SectionCut, SectionCutter
from gapbeam.solver.loads.attachments import DISPLACEMENTS, MeanMotion
from gapbeam.solver.loads.load_choice import axis_point
from gapbeam.solver.system.operators import Array, Indices, Operators, row_product

CENTERED = 1.0e-9  # of the radius of gyration: a centroid this near to the axis lies on it


@dataclass(frozen=True)
class MotionRow:
    """Row of the motion of a point: factors of the displacements of its nodes, on the nodes that this rank owns.

    Attributes:
        nodes: Owned nodes (blocks), (k,).
        factors: Of their displacements, (components, k, components).
    """

    nodes: Indices
    factors: Array

    def evaluate(self, x: Array, operators: Operators) -> Array:
        """Return the displacement, (components,), or row by row of x, (times, components). Collective."""
        components = len(self.factors)
        moved = x.reshape(-1, x.shape[-1] // components, components)[:, self.nodes, :]
        rows = row_product(moved.reshape(len(moved), -1), self.factors.reshape(components, -1).T)
        return operators.sum(rows.reshape(*x.shape[:-1], components))

    def force(self, direction: Array, size: int) -> Array:
        """Return the nodal forces of a unit force along a direction, (n,), local."""
        pattern = np.zeros((size // len(self.factors), len(self.factors)))
        pattern[self.nodes] = np.tensordot(direction, self.factors, axes=1)
        return pattern.reshape(-1)


class SectionRows:
    """The rows of mean motions on a mesh; each section is cut once."""

    def __init__(self, space: Any) -> None:
        """Prepare the mesh. Collective.

        Args:
            space: Blocked Lagrange space.
        """
        self.space = space
        self.cutter = SectionCutter(space)
        self.cuts = dict[float, SectionCut]()

    def of_motions(self, motions: Sequence[MeanMotion], size: int) -> Iterator[Array]:
        """Yield the row of each mean motion: the motion is the scalar product of row and displacements, over all ranks.

        Args:
            motions: The motions.
            size: Number of DOFs that this rank owns.

        Yields:
            (size,).

        Raises:
            UserError: The mesh has no section at a place; on all ranks.

        Collective.
        """
        for motion in motions:
            nodes, factors = self._owned(motion, "a joint, a mass, a fluid or a restraint")
            found = np.zeros((size // factors.shape[1], factors.shape[1]))
            found[nodes] = factors
            yield found.reshape(-1)

    def of_axis(self, x: float, name: str) -> MotionRow:
        """Return the row of the point on the axis at x, m, as its section carries it on average.

        Args:
            x: The place, m.
            name: Name of the point in errors.

        Raises:
            UserError: The mesh has no section there; on all ranks.

        Collective.
        """
        moments = self._cut(x, name).moments
        center = moments[0, 1:] / moments[0, 0]
        beside, above = (0.0, float(center[0])) if len(center) == 1 else (float(center[0]), float(center[1]))
        centered = np.hypot(beside, above) <= CENTERED * np.sqrt(np.trace(moments[1:, 1:]) / moments[0, 0])
        offset = (0.0, 0.0, 0.0) if centered else (0.0, -beside, -above)
        names = DISPLACEMENTS if len(moments) == 3 else ("axial", "vertical")
        rows = [self._owned(MeanMotion(x, one, offset), name) for one in names]
        return MotionRow(rows[0][0], np.stack([factors for _, factors in rows]))

    def of_turn(self, x: float, name: str) -> MotionRow:
        """Return the row of the rotation of the section at x in the bending plane, as its last component, rad.

        Args and errors as in `of_axis`. Collective.
        """
        nodes, factors = self._owned(MeanMotion(x, "rotation"), name)
        return MotionRow(nodes, np.stack([*np.zeros((factors.shape[1] - 1, *factors.shape)), factors]))

    def _cut(self, x: float, name: str) -> SectionCut:
        if x not in self.cuts:
            self.cuts[x] = self.cutter.cut(x, name)
        return self.cuts[x]

    def _owned(self, motion: MeanMotion, name: str) -> tuple[Indices, Array]:
        """Return the nodes of this rank, (k,), and the factors of their displacements, (k, dimension)."""
        cut = self._cut(motion.x, name)
        first, last = self.space.dofmap.index_map.local_range
        mine = (cut.nodes >= first) & (cut.nodes < last)
        return cut.nodes[mine] - first, cut.integrals[mine] @ motion.factors(cut.moments).T


def row_at(sections: SectionRows, point: float | tuple[float, ...], name: str) -> PointRow | MotionRow:
    """Return the row of a point of the body, or of the cross-section for a point on the axis.

    Args:
        sections: Sections of the mesh.
        point: x on the axis, or all coordinates, m.
        name: Name of the point in errors.

    Raises:
        UserError: The point, or the section, lies outside the mesh; on all ranks.

    Collective.
    """
    place = axis_point(point)
    return point_row(sections.space, place, name) if np.any(place[1:]) else sections.of_axis(float(place[0]), name)
