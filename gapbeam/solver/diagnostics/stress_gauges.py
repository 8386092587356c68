"""The stress at probes, from the displacement gradient in the cells that meet there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.diagnostics.assumptions.pose_watch import PoseRows, PoseScales, axial_stress, deformation
from gapbeam.solver.system.operators import Array, Indices


@dataclass(frozen=True)
class Gauges:
    """Stress gauges at k probes.

    Attributes:
        rows: Give the gradient at each probe in each cell that holds it.
        scales: Material, and how strain is completed.
        numbers: The probe of each of these points, ascending.
        shares: One over the number of cells that meet at a probe, (k,).
    """

    rows: PoseRows
    scales: PoseScales
    numbers: Indices
    shares: Array

    def stresses(self, u: Array) -> tuple[Array, Array]:
        """Return axial and von Mises stress, (times, k) each, Pa; the gradient is the mean of the cells.

        Args:
            u: Marched DOFs, (times, n).

        Collective.
        """
        gradient = self.rows.poses(u)[1]
        mean = np.zeros((len(u), len(self.shares), *gradient.shape[2:]))
        for cell, probe in enumerate(self.numbers):
            mean[:, probe] += gradient[:, cell] * self.shares[probe]
        return axial_stress(mean, self.scales), deformation(mean, self.scales)[2]
