"""Wear rates of a case on given gaps, from the statistics of one run, by face or by contact point.

Gaps of contact points grow where they are worn,

    dd_i / dt = k W_i' / w_i

for the depth d_i of the contact point i, its work rate W_i' on gaps that are larger by d, and the area w_i that belongs
to it. The region of the support thus changes its profile.

Source: Podra and Andersson, Tribology International 32 (1999) 71, for wear that changes the contact it depends on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.face_wear import FaceWear, face_wear
from gapbeam.solver.diagnostics.statistics.run_statistics import PointStatistics, RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE, Doubts
from gapbeam.solver.errors import RunError, UserError
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.stop_rule import decay_time, has_statistics, statistics_of
from gapbeam.studies.life.worn_case import worn_case
from gapbeam.studies.life.worn_march import Array, DepthRates
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import KeptBody, seated

PERIODS = 100  # of a forcing, of which statistics need some dozens behind the burn-in
WHOLE = 1.0e-6
REPEATED = 1.0e-4  # of a rate, between the ends of the interval of a motion that repeats


class RunFailed(RunError):  # noqa: N818 - as other ends of runs are called
    """A run on worn gaps did not pass.

    Attributes:
        exit_status: Of that run.
    """

    def __init__(self, message: str, exit_status: int) -> None:
        super().__init__(message, exit_status)
        self.exit_status = exit_status


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
    def factors(self) -> Array:
        """Depth worn per work of sliding of each face, (faces,), m/J."""
        return np.array([(one.coefficient or 0.0) / (one.area or 1.0) for one in self.wear.values()])

    def __call__(self, depths: Array, number: int) -> DepthRates:
        """Return the rates at given depths.

        Args:
            depths: Of all faces, (faces,), m.
            number: Of the run, which chooses the noise.

        Raises:
            RunFailed: The run did not pass.
            UserError: It has too few records for statistics.
        """
        worn = list(map(float, depths))
        model, factors = self.body.model(worn_case(self.case, worn, number)), self.factors
        statistics = self.statistics_of(model)
        verdicts = self.marched(model, statistics, worn)
        found = _work_rates(statistics, self.case.time.end)
        rates = [found[name] for name in self.names]
        values, low, high = (
            factors * np.array([max(float(one[key]), 0.0) for one in rates]) for key in ("value", "low", "high")
        )
        return DepthRates(values, low, high, verdicts)

    def statistics_of(self, model: Model) -> RunStatistics:
        """Return the statistics to gather in a run."""
        return _statistics(model, _every(model))

    def marched(self, model: Model, statistics: RunStatistics, depths: Sequence[float]) -> tuple[str, ...]:
        """March a model and gather its statistics; return the verdict on the work rate of each face.

        Args:
            model: On worn gaps.
            statistics: Of `statistics_of`.
            depths: Of all faces, for the message, m.

        Raises:
            RunFailed: The run did not pass.
            UserError: It has too few records for statistics.
        """
        steps = round(model.case.time.end / model.step)
        start = seated(model).state
        response = respond(model, start, steps, statistics.interval, watched=True, statistics=statistics)
        if response.exit_status:
            worn = ", ".join(f"{name} {depth:.3g} m" for name, depth in zip(self.names, depths, strict=True))
            raise RunFailed(
                f"the run with the faces worn by {worn} did not pass: {response.verdict}: {response.message}",
                response.exit_status,
            )
        found = _work_rates(statistics, model.case.time.end, response.doubts)
        return tuple("good" if _repeats(found[name]) else str(found[name]["verdict"]) for name in self.names)

    @property
    def names(self) -> Sequence[str]:
        """Names of the faces."""
        return [face.name for face in self.case.layout.faces]


def _repeats(rate: Mapping[str, Any]) -> bool:
    """Return whether an interval is that of a motion that repeats."""
    return float(rate["high"]) - float(rate["low"]) < REPEATED * float(rate["value"])


def _every(model: Model) -> int:
    """Return the steps between records: those of the case, or a period of a forcing that repeats often enough.

    The work of whole periods is the same in a motion that repeats, and has no chance in it.
    """
    case, step = model.case, model.step
    frequencies = forcing_frequencies(case.load)
    if not has_statistics(case) and len(frequencies) == 1 and frequencies[0] * case.time.end >= PERIODS:
        steps = round(1.0 / (frequencies[0] * step))
        if abs(steps * step * frequencies[0] - 1.0) < WHOLE:
            return steps
    return max(1, round((case.output.history_interval or step) / step))


def _statistics(model: Model, every: int) -> RunStatistics:
    """Return the statistics to gather in a run, of a case without noise, too."""
    case, faces = model.case, tuple(model.system.contact.face_names)
    return statistics_of(model, every) or RunStatistics(
        faces, tuple(model.probes), bends_in_two_planes(case), every * model.step, decay_time(case), True
    )


def _work_rates(statistics: RunStatistics, end: float, doubts: Doubts | None = None) -> dict[str, Mapping[str, Any]]:
    """Return the work rate of each face with its interval, as statistics describe it, W."""
    figures = {one["name"]: one for one in statistics.describe(doubts)["figures"]}
    if not figures:
        raise UserError(
            f"time.end: {end:g} s with a record every {statistics.interval:g} s are too few records for the mean of a "
            "work rate; expected a hundred and more: a later time.end, or a shorter output.history_interval"
        )
    return {face: figures[f"face.{face}.{WORK_RATE}"] for face in statistics.faces}


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
