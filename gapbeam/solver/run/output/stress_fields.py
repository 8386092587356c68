"""Axial and von Mises stress at the corners of the cells, by the rules of the stress at probes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem

from gapbeam.solver.assembly.corner_gradients import CornerGradients
from gapbeam.solver.diagnostics.assumptions.pose_watch import PoseScales, axial_stress, deformation
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.pose_rows import scales_of
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class StressFields:
    """Stress fields of a displacement.

    Attributes:
        gradients: Give its gradient.
        scales: Material, and how strain is completed.
        displacement: On the mesh, which the values go to.
    """

    gradients: CornerGradients
    scales: PoseScales
    displacement: fem.Function

    @classmethod
    def of_model(cls, model: Model, linear: Any) -> StressFields | None:
        """Return the stress fields of a model whose case asks for them, at corners of a linear space. Collective."""
        if not model.case.output.stress:
            return None
        return cls(
            CornerGradients.of_spaces(model.space, linear),
            scales_of(model.case, np.zeros(1)),
            fem.Function(model.space),
        )

    def at_corners(self, values: Array) -> dict[str, Array]:
        """Return the stresses at the corners that this rank owns, (n,) each, Pa.

        Args:
            values: DOFs of the displacement on the mesh that this rank owns, m.

        Collective.
        """
        self.displacement.x.array[: len(values)] = values
        self.displacement.x.scatter_forward()
        gradient = self.gradients.mean(self.displacement)
        return {
            "axial_stress": axial_stress(gradient, self.scales),
            "von_mises_stress": deformation(gradient, self.scales)[2],
        }
