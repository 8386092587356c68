"""Wear rates of a case on gaps that are worn: of faces, or of contact points, from the statistics of one run each.

Gaps of contact points grow where they are worn,

    dd_i / dt = k W_i' / w_i

for the depth d_i of the contact point i, its work rate W_i' on gaps that are larger by d, and the area w_i that belongs
to it. The region of the support thus changes its profile.

Source: Podra and Andersson, Tribology International 32 (1999) 71, for wear that changes the contact it depends on.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.face_wear import FaceWear, face_wear
from gapbeam.solver.diagnostics.statistics.run_statistics import PointStatistics, RunStatistics
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.stop_rule import decay_time, has_statistics, statistics_of
from gapbeam.studies.life.face_rates import depth_rates, passed, rate_verdict, record_steps, work_rates
from gapbeam.studies.life.worn_case import worn_case, worn_clearances
from gapbeam.studies.life.worn_march import Array, DepthRates
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import KeptBody, seated


@dataclass
class CaseRates:
    """Runs of a case on worn gaps, one after the other; the body is set up once.

    Attributes:
        case: Not worn, with [wear], and an area of every face that wears.
        body: Body that the runs share.
    """

    case: Case
    body: KeptBody = field(default_factory=KeptBody)

    @property
    def wear(self) -> Mapping[str, FaceWear]:
        """Wear of each face, by name."""
        return face_wear(self.case)

    @property
    def inputs(self) -> dict[str, Any]:
        """All that decides the rates."""
        return dict(json.loads(self.case.model_dump_json()))

    @cached_property
    def limits(self) -> Array:
        """Depth at which the life of each face ends, as `refuse_unworn`, (faces,), m."""
        return refuse_unworn(self.case)

    def clearances(self, depths: Array) -> dict[str, float]:
        """Return the clearance of each support at depths of the faces, (faces,), m."""
        return worn_clearances(worn_case(self.case, list(map(float, depths))))

    @property
    def factors(self) -> Array:
        """Depth worn per work of sliding of each face, (faces,), m/J."""
        return np.array([(one.coefficient or 0.0) / (one.area or 1.0) for one in self.wear.values()])

    def __call__(self, depths: Array, number: int) -> DepthRates:
        """Return the rates at given depths.

        Args:
            depths: Depths of all faces, (faces,), m.
            number: Number of the run, which chooses the noise.

        Raises:
            RunFailed: The run did not pass.
            UserError: It has too few records for statistics.
        """
        worn = list(map(float, depths))
        model = self.body.model(worn_case(self.case, worn, number))
        return depth_rates(self.marched(model, self.statistics_of(model), worn), self.factors)

    def statistics_of(self, model: Model) -> RunStatistics:
        """Return the statistics to gather in a run."""
        case = self.case
        interval = case.output.history_interval or model.step
        every = record_steps(() if has_statistics(case) else case.load, case.time.end, model.step, interval)
        return statistics_of(model, every) or RunStatistics(
            tuple(model.system.contact.face_names), tuple(model.probes), bends_in_two_planes(case),
            every * model.step, decay_time(case), True,
        )  # fmt: skip

    def marched(self, model: Model, statistics: RunStatistics, depths: Sequence[float]) -> list[Mapping[str, Any]]:
        """March a model and gather its statistics; return the work rate of each face, of `work_rates`.

        Args:
            model: On worn gaps.
            statistics: Of `statistics_of`.
            depths: Depths of all faces, for the message, m.

        Raises:
            RunFailed: The run did not pass.
            UserError: It has too few records for statistics.
        """
        steps = round(model.case.time.end / model.step)
        start = seated(model).state
        response = respond(model, start, steps, statistics.interval, watched=True, statistics=statistics)
        passed(response, self.names, depths)
        return work_rates(statistics, self.names, model.case.time.end, response.doubts)

    @property
    def names(self) -> Sequence[str]:
        """Names of the faces."""
        return [face.name for face in self.case.layout.faces]


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
        verdicts = [rate_verdict(one) for one in self.marched(model, statistics, deepest)]
        factors, found = self.point_factors, statistics.work_rates()
        ends = np.array([(one.value, one.low, one.high) for one in found]).T
        values, low, high = (factors * np.maximum(end, 0.0) for end in ends)
        return DepthRates(values, low, high, tuple(verdicts[face] for face in self.owners))


def refuse_unworn(case: Case) -> Array:
    """Return the depth at which the life of each face ends, (faces,), m; 1 of a face that does not wear and has none.

    Raises:
        UserError: A face that wears has none, nothing wears, or the case is no march, or has faults when it is worn.
    """
    faces = face_wear(case)
    lacking = [name for name, one in faces.items() if one.wears and one.depth_limit is None]
    if case.wear is None or lacking or not any(one.depth_limit for one in faces.values()):
        of_one = f" for {', '.join(lacking)}" if 0 < len(lacking) < len(faces) else ""
        raise UserError(
            "a life ends at a depth, which is a volume over an area: expected depth_limit, coefficient and area in "
            f"[wear], or in [[support]]; found {'no [wear]' if case.wear is None else f'no depth_limit{of_one}'}; try "
            "depth_limit = 0.2e-3"
        )
    if not any(one.wears for one in faces.values()):
        raise UserError(
            "wear.coefficient: found no coefficient but 0: nothing wears and no face has a life; expected one above 0 "
            "for a support at least, such as 2e-14 1/Pa"
        )
    if not isinstance(case.analysis, Transient):
        raise UserError(
            f'analysis.type: found "{case.analysis.type}"; expected "transient": the rates of a life are means of '
            "marches"
        )
    even = case.wear.growth == "even"  # otherwise the case stays as it is
    depths = [(one.depth_limit or 0.0) if one.wears and even else 0.0 for one in faces.values()]
    faults = contradictions_in(worn_case(case, depths))
    if faults:
        worn = ", ".join(f"{name} {depth:g} m" for name, depth in zip(faces, depths, strict=True))
        raise UserError(
            f"depth_limit: with the faces worn to their limits ({worn}) the case has faults: "
            + "; ".join(" ".join(str(one).split()) for one in faults[:3])
        )
    return np.array([one.depth_limit or 1.0 for one in faces.values()])
