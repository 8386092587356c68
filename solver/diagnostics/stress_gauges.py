"""The stress at probes, from the displacement gradient in the cells that meet there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.diagnostics.assumptions.pose_watch import PoseRows, PoseScales, axial_stress, deformation
from gapbeam.solver.system.operators import Array, Indices


@dataclass(frozen=True)
class Gauges:
    """What reads the stress at k probes.

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
        axial, equivalent = [], []
        for one in u:
            gradient = self.rows.pose(one)[1]
            mean = np.zeros((len(self.shares), *gradient.shape[1:]))
            np.add.at(mean, self.numbers, gradient * self.shares[self.numbers, None, None])
            axial.append(axial_stress(mean, self.scales))
            equivalent.append(deformation(mean, self.scales)[2])
        return np.array(axial), np.array(equivalent)
