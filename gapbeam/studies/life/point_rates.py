"""The rates at which a case wears each of its contact points: gaps that grow where they are worn.

    dd_i / dt = k W_i' / w_i

for the depth d_i of the contact point i, its work rate W_i' on gaps that are larger by d, and the area w_i that belongs
to it. The region of the support thus changes its profile.

Source: Podra and Andersson, Tribology International 32 (1999) 71, for wear that changes the contact it depends on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gapbeam.solver.diagnostics.statistics.point_statistics import PointStatistics
from gapbeam.solver.models.model import Model
from gapbeam.studies.life.case_rates import CaseRates
from gapbeam.studies.life.worn_case import worn_case
from gapbeam.studies.life.worn_march import Array, DepthRates


@dataclass
class PointRates(CaseRates):
    """Runs of a case on worn profiles, one after the other; depths and rates are those of the contact points."""

    @cached_property
    def unworn(self) -> Model:
        """The model, not worn."""
        return self.body.model(self.case)

    @cached_property
    def owners(self) -> Array:
        """Index of the face of each point, (m,)."""
        return np.asarray(self.unworn.system.contact.faces)

    @property
    def point_factors(self) -> Array:
        """Depth worn per work of sliding of each point, k / w, (m,), m/J."""
        coefficients = np.array([one.coefficient or 0.0 for one in self.wear.values()])
        return np.asarray(coefficients[self.owners] / self.unworn.system.contact.weights)

    def __call__(self, depths: Array, number: int) -> DepthRates:
        """Return the rates at depths of all points, (m,), m; else as `CaseRates`."""
        model = self.body.model(worn_case(self.case, [0.0] * len(self.names), number))
        contact = model.system.contact
        worn = replace(contact.worn(depths), maps_sliding=True)
        model = replace(model, system=replace(model.system, contact=worn))
        deepest = [float(depths[self.owners == face].max()) for face in range(len(self.names))]
        usual = self.statistics_of(model)
        statistics = PointStatistics(
            usual.faces, usual.probes, usual.in_space, usual.interval, usual.decay, usual.slides, points=contact.size
        )
        verdicts = self.marched(model, statistics, deepest)
        factors, found = self.point_factors, statistics.work_rates()
        ends = np.array([(one.value, one.low, one.high) for one in found]).T
        values, low, high = (factors * np.maximum(end, 0.0) for end in ends)
        return DepthRates(values, low, high, tuple(verdicts[face] for face in self.owners))
