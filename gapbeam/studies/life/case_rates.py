"""Wear rates on worn gaps: of a case by faces or contact points, or of a file of structures by pairs.

Gaps of contact points grow where they are worn,

    dd_i / dt = k W_i' / w_i

for the depth d_i of the contact point i, its work rate W_i' on gaps that are larger by d, and the area w_i that belongs
to it. The region of the support thus changes its profile.

Source: Podra and Andersson, Tribology International 32 (1999) 71, for wear that changes the contact it depends on.

dd_i / dt = k W_i' / A

for the depth d_i of pair i, its work rate W_i' in regions grown by all depths, and the worn area A.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.diagnostics.statistics.run_statistics import PointStatistics, RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE, Doubts
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.loads.scene_load_choice import AnyLoad
from gapbeam.solver.messages.errors import RunError, UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.output.wear_file import FaceWear, face_wear
from gapbeam.solver.run.stop_rule import decay_time, has_statistics, statistics_of
from gapbeam.studies.life.worn_case import worn_case, worn_clearances
from gapbeam.studies.life.worn_march import DepthRates
from gapbeam.studies.trials.response import TrialResponse, respond
from gapbeam.studies.trials.scene_subject import CaseSubject, SceneSubject
from gapbeam.studies.trials.starts import KeptBody, seated
from gapbeam.studies.trials.subject import shared_inputs

PERIODS = 100  # of a forcing, of which statistics need some dozens behind the burn-in
WHOLE = 1.0e-6
REPEATED = 1.0e-4  # of a rate, between the ends of the interval of a motion that repeats


class RunFailed(RunError):  # noqa: N818 - as other ends of runs are called
    """A run on worn gaps did not pass.

    Attributes:
        exit_status: Exit status of that run.
    """

    def __init__(self, message: str, exit_status: int) -> None:
        super().__init__(message, exit_status)
        self.exit_status = exit_status


def passed(response: TrialResponse, names: Sequence[str], depths: Sequence[float]) -> None:
    """Pass a run on worn gaps.

    Args:
        response: Response of the run.
        names: Names of the faces.
        depths: Depths of all faces, m.

    Raises:
        RunFailed: The run did not pass.
    """
    if response.exit_status:
        worn = ", ".join(f"{name} {depth:.3g} m" for name, depth in zip(names, depths, strict=True))
        raise RunFailed(
            f"the run with the faces worn by {worn} did not pass: {response.verdict}: {response.message}",
            response.exit_status,
        )


def rate_verdict(rate: Mapping[str, Any]) -> str:
    """Return the verdict on the interval of a rate; that of a motion that repeats is good."""
    repeats = float(rate["high"]) - float(rate["low"]) < REPEATED * float(rate["value"])
    return "good" if repeats else str(rate["verdict"])


def record_steps(loads: Sequence[AnyLoad], end: float, step: float, interval: float) -> int:
    """Return the steps between records: of an interval, or a period of a forcing that repeats often enough.

    The work of whole periods is the same in a motion that repeats, and is not random.

    Args:
        loads: Loads that may force a motion that repeats.
        end: End of the run, s.
        step: s.
        interval: s.
    """
    frequencies = forcing_frequencies(loads)
    if len(frequencies) == 1 and frequencies[0] * end >= PERIODS:
        steps = round(1.0 / (frequencies[0] * step))
        if abs(steps * step * frequencies[0] - 1.0) < WHOLE:
            return steps
    return max(1, round(interval / step))


def depth_rates(works: Sequence[Mapping[str, Any]], factors: ArrayLike) -> DepthRates:
    """Return rates of depth, m/s, from work rates.

    Args:
        works: Works of each face, of `work_rates`.
        factors: Depth worn per work of sliding of each face, m/J.
    """
    values, low, high = (
        np.asarray(factors) * np.array([max(float(one[key]), 0.0) for one in works]) for key in ("value", "low", "high")
    )
    return DepthRates(values, low, high, tuple(map(rate_verdict, works)))


def work_rates(
    statistics: RunStatistics, names: Sequence[str], end: float, doubts: Doubts | None = None
) -> list[Mapping[str, Any]]:
    """Return the work rate of each face with its interval, as statistics describe it, W.

    Args:
        statistics: Statistics of a run.
        names: Names of the faces.
        end: End of the run, s.
        doubts: Doubts on the statistics.

    Raises:
        UserError: The run has too few records for statistics.
    """
    figures = {one["name"]: one for one in statistics.describe(doubts)["figures"]}
    if not figures:
        raise UserError(
            f"time.end: {end:g} s with a record every {statistics.interval:g} s are too few records for the mean of a "
            "work rate; expected a hundred and more: a later time.end, or a shorter output.history_interval"
        )
    return [figures[f"face.{name}.{WORK_RATE}"] for name in names]


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
        return shared_inputs([CaseSubject(self.case)])

    @cached_property
    def limits(self) -> np.ndarray:
        """Depth at which the life of each face ends, as `refuse_unworn`, (faces,), m."""
        return refuse_unworn(self.case)

    def clearances(self, depths: np.ndarray) -> dict[str, float]:
        """Return the clearance of each support at depths of the faces, (faces,), m."""
        return worn_clearances(worn_case(self.case, list(map(float, depths))))

    @property
    def factors(self) -> np.ndarray:
        """Depth worn per work of sliding of each face, (faces,), m/J."""
        return np.array([(one.coefficient or 0.0) / (one.area or 1.0) for one in self.wear.values()])

    def __call__(self, depths: np.ndarray, number: int) -> DepthRates:
        """Return the rates at given depths.

        Args:
            depths: Depths of all faces, (faces,), m.
            number: Number of the run, which chooses the noise.

        Raises:
            RunFailed: The run did not pass.
            UserError: The run has too few records for statistics.
        """
        worn = list(map(float, depths))
        model = self.body.model(worn_case(self.case, worn, number))
        return depth_rates(self.marched(model, self.statistics_of(model), worn), self.factors)

    def statistics_of(self, model: Model) -> RunStatistics:
        """Return the statistics to gather in a run."""
        case = self.case
        interval = case.output.history_interval or model.step
        every = record_steps(() if has_statistics(case) else case.load, case.time.end, model.step, interval)
        return statistics_of(case, model, every) or RunStatistics(
            tuple(model.system.contact.face_names), tuple(model.probes), bends_in_two_planes(case),
            every * model.step, decay_time(case), True,
        )  # fmt: skip

    def marched(self, model: Model, statistics: RunStatistics, depths: Sequence[float]) -> list[Mapping[str, Any]]:
        """March a model and gather its statistics; return the work rate of each face, of `work_rates`.

        Args:
            model: Model on worn gaps.
            statistics: Result of `statistics_of`.
            depths: Depths of all faces, for the message, m.

        Raises:
            RunFailed: The run did not pass.
            UserError: The run has too few records for statistics.
        """
        steps = round(model.end / model.step)
        start = seated(model).state
        response = respond(model, start, steps, statistics.interval, watched=True, statistics=statistics)
        passed(response, self.names, depths)
        return work_rates(statistics, self.names, model.end, response.doubts)

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
    def owners(self) -> np.ndarray:
        """Index of the face of each point, (m,)."""
        return np.asarray(self.unworn.system.contact.faces)

    @property
    def point_factors(self) -> np.ndarray:
        """Depth worn per work of sliding of each point, k / w, (m,), m/J."""
        coefficients = np.array([one.coefficient or 0.0 for one in self.wear.values()])
        return np.asarray(coefficients[self.owners] / self.unworn.system.contact.weights)

    def __call__(self, depths: np.ndarray, number: int) -> DepthRates:
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


def refuse_unworn(case: Case) -> np.ndarray:
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


class SceneRates:
    """Runs of a file of structures on worn pairs, one after the other; they share the structures.

    Pairs of two motions wear: those of one have no sliding.

    Args:
        subject: The file.

    Raises:
        CaseError: A structure cannot be read, or parts do not fit.
    """

    def __init__(self, subject: SceneSubject) -> None:
        self.subject, self.scene = subject, subject.scene
        self.mine = [i for i, one in enumerate(self.scene.contacts) if one.region.motions == 2]
        every = self.scene.contact_names
        self.names = [every[i] for i in self.mine]

    @property
    def inputs(self) -> dict[str, Any]:
        """All that decides the rates."""
        return shared_inputs([self.subject])

    @cached_property
    def limits(self) -> np.ndarray:
        """Depth at which the life of each pair ends, (pairs,), m.

        Raises:
            UserError: The file has no depth or coefficient, no pair slides, or a region cannot grow.
        """
        wear = self.subject.case.wear
        lacking = [name for name in ("coefficient", "area", "depth_limit") if wear is None or not getattr(wear, name)]
        if lacking:
            raise UserError(
                f"wear: found no {' and no '.join(lacking)}; expected all three, such as coefficient = 2e-14 (1/Pa), "
                "area = 1e-5 (m^2) and depth_limit = 0.2e-3 (m)"
            )
        if not self.mine:
            raise UserError("wear: found no pair of two motions, whose sliding wears; expected one (motions = 2)")
        assert wear is not None
        limits = np.full(len(self.mine), wear.depth_limit or 0.0)
        self.worn(limits)
        return limits

    def worn(self, depths: np.ndarray, number: int = 0) -> SceneSubject:
        """Return the file with regions grown by depths.

        Args:
            depths: Depths of all pairs, (pairs,), m.
            number: Number of the run: each has noise of its own.

        Raises:
            UserError: A region cannot grow.
        """
        subject = self.subject.with_other_noise(number)
        scene = subject.scene
        contacts = list(scene.contacts)
        for i, depth in zip(self.mine, depths, strict=True):
            contacts[i] = replace(contacts[i], region=contacts[i].region.grown(float(depth)))
        return subject.in_scene(scene.with_parts(contacts, scene.loads))

    def clearances(self, depths: np.ndarray) -> dict[str, float]:
        """Return the clearance of each pair at depths, (pairs,), m."""
        contacts = self.worn(depths).scene.contacts
        regions = {name: contacts[i].region for name, i in zip(self.names, self.mine, strict=True)}
        return {
            name: float(np.asarray(one.values[one.kind.names.index("clearance")]))
            for name, one in regions.items()
            if "clearance" in one.kind.names
        }

    def __call__(self, depths: np.ndarray, number: int) -> DepthRates:
        """Return the rates at given depths.

        Args:
            depths: Depths of all pairs, (pairs,), m.
            number: Number of the run, which chooses the noise.

        Raises:
            RunFailed: The run did not pass.
            UserError: The run has too few records for statistics, or there is no seat.
        """
        subject, case = self.worn(depths, number), self.subject.case
        asked, end = subject.asked, case.time.end
        subject.asked = replace(asked, every=record_steps(case.load, end, asked.step, asked.every * asked.step))
        response = subject.respond(subject.start(0, 0), rings=False)
        passed(response, self.names, list(map(float, depths)))
        assert response.statistics is not None
        assert case.wear is not None
        factor = float(case.wear.coefficient or 0.0) / float(case.wear.area or 1.0)
        return depth_rates(work_rates(response.statistics, self.names, end), factor)
