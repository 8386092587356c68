"""Axial and von Mises stress, and motion, at the corners of the cells, by the rules of the stress at probes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import issparse

from gapbeam.meshes.serial_mesh import SerialSpace
from gapbeam.solver.assembly.face_quadrature import CornerGradients
from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.assumption import PoseScales, axial_stress, deformation
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.pose_rows import scales_of
from gapbeam.solver.system.operators import Array, Indices, row_product


@dataclass(frozen=True)
class StressFields:
    """Stress fields of a displacement.

    Attributes:
        gradients: Give its gradient.
        scales: Material, and how strain is completed.
        displacement: Displacement on the mesh, which the values go to; None where a rank has all that it needs.
    """

    gradients: CornerGradients
    scales: PoseScales
    displacement: Any

    @classmethod
    def of_case(cls, case: Case, model: Model, linear: Any) -> StressFields | None:
        """Return the stress fields of a case that asks for them, at corners of a linear space. Collective."""
        if not case.output.stress:
            return None
        displacement = None
        if not isinstance(model.space, SerialSpace):
            from dolfinx import fem

            displacement = fem.Function(model.space)
        return cls(CornerGradients.of_spaces(model.space, linear), scales_of(case, np.zeros(1)), displacement)

    def at_corners(self, values: Array) -> dict[str, Array]:
        """Return the stresses at the corners that this rank owns, (n,) each, Pa.

        Args:
            values: DOFs of the displacement on the mesh that this rank owns, m.

        Collective.
        """
        if self.displacement is not None:
            self.displacement.x.array[: len(values)] = values
            self.displacement.x.scatter_forward()
            values = self.displacement.x.array
        gradient = self.gradients.mean(values)
        return {
            "axial_stress": axial_stress(gradient, self.scales),
            "von_mises_stress": deformation(gradient, self.scales)[2],
        }


@dataclass(frozen=True)
class CornerValues:
    """Values at the corners that this rank owns, taken from the DOFs that are marched.

    A corner of a cell is a node of the space of the displacement, so its values are DOFs: nothing is interpolated. Of a
    reduced model only the rows of the corners are expanded.

    Attributes:
        rows: DOFs of the mesh at the corners, among those that this rank owns, (n d,).
        components: d, of the displacement.
        expansion: Rows of the corners in the expansion of the model, transposed, (k, n d); None: the mesh is marched.
    """

    rows: Indices
    components: int
    expansion: Any

    @classmethod
    def of_model(cls, model: Model, linear: Any) -> CornerValues:
        """Return the corner values of a model.

        Args:
            model: The model.
            linear: Blocked linear Lagrange space on the same mesh, whose nodes are the corners.

        Collective.
        """
        block, owned = linear.dofmap.index_map_bs, linear.dofmap.index_map.size_local
        corners, nodes = np.asarray(linear.dofmap.list), np.asarray(model.space.dofmap.list)
        there = np.zeros(int(np.max(corners, initial=-1)) + 1, dtype=np.int64)
        there[corners] = nodes[:, : corners.shape[1]]  # of a cell corners come first
        rows = (there[:owned, None] * block + np.arange(block)).reshape(-1)
        assert np.all(rows < model.space.dofmap.index_map.size_local * block), "a rank owns a corner, not its node"
        expansion = model.body.expansion
        if expansion is None:
            return cls(rows, block, None)
        taken = expansion[rows].T
        return cls(rows, block, taken if issparse(taken) else np.ascontiguousarray(taken))

    def vectors(self, marched: Array) -> Array:
        """Return vectors in space, (times, n, 3).

        Args:
            marched: DOFs that are marched, of which those of the beam come first, (times, DOFs).
        """
        if self.expansion is None:
            values = marched[:, self.rows]
        elif issparse(self.expansion):
            values = np.stack([one[: self.expansion.shape[0]] @ self.expansion for one in marched])
        else:
            values = row_product(marched[:, : len(self.expansion)], self.expansion)
        shaped = values.reshape(len(marched), -1, self.components)
        return np.pad(shaped, ((0, 0), (0, 0), (0, 3 - self.components))) if self.components < 3 else shaped
