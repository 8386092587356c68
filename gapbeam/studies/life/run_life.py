"""The life of the supports of a case: runs on gaps that grow, block by block, until a face is worn to the limit.

Wear rates on given gaps follow from the statistics of one run, by face or by contact point.

Gaps of contact points grow where they are worn,

    dd_i / dt = k W_i' / w_i

for the depth d_i of the contact point i, its work rate W_i' on gaps that are larger by d, and the area w_i that belongs
to it. The region of the support thus changes its profile.

Source: Podra and Andersson, Tribology International 32 (1999) 71, for wear that changes the contact it depends on.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.face_wear import FaceWear, face_wear
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.statistics.run_statistics import PointStatistics, RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE, Doubts
from gapbeam.solver.errors import RangeNotCovered, RunError, UserError
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.run.stop_rule import decay_time, has_statistics, statistics_of
from gapbeam.studies.life.worn_case import (
    PROFILES_FILE,
    KeptRuns,
    Profiles,
    of_faces,
    time_words,
    worn_case,
    worn_clearances,
)
from gapbeam.studies.life.worn_march import Array, Blocks, DepthRates, Worn, WornState, wear_to_limits
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import study_folder, study_written
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


LIFE_FILE, TABLE_FILE = "life.json", "life.csv"
ORDER = ("good", "no event", "biased", "too short", "not settled")
WHY = {
    "time": "the time that was asked for was reached",
    "runs": "as many runs were made as allowed; more of them go on where this ended",
    "nothing slides": "no face slides any more under a force",
}


@dataclass(frozen=True, repr=False)
class LifeResult(PrintedResult):
    """Life of the supports of a case.

    Attributes:
        folder: Where its files are.
        case: Not worn.
        limits: Depth at which the life of each face ends, (faces,), m.
        faces: Names of the faces.
        worn: Result of the march.
        kept: Number of runs found on disk.
        profiles: Depths of all contact points, where each grows by itself; depths of faces are then the deepest.
    """

    folder: Path
    case: Case
    limits: Array
    faces: Sequence[str]
    worn: Worn
    kept: int = 0
    profiles: Profiles | None = None

    @property
    def limit(self) -> float:
        """The limit of the face that is first, m; the smallest where nothing slides."""
        return float(self.limits.min() if self.worn.first is None else self.limits[self.worn.first])

    @property
    def exit_status(self) -> int:
        """0: the limit was reached, or the depths are known at the time that was asked for; 5: neither."""
        known = self.worn.life is not None or self.worn.reason == "time"
        return 0 if known else RangeNotCovered.exit_status

    @property
    def paths(self) -> list[Path]:
        """The files."""
        files = [LIFE_FILE, TABLE_FILE, *([] if self.profiles is None else [PROFILES_FILE])]
        return [self.folder / name for name in files]

    @property
    def verdict(self) -> str:
        """The worst verdict on an interval of a rate of the face in question."""
        first = self.worn.first
        words = [state.rates.verdicts[first] for state in self.worn.states] if first is not None else ["no event"]
        return max(words, key=ORDER.index)

    def headline(self) -> str:
        """Return the life, or why there is none, in one line."""
        worn = self.worn
        if worn.first is None:
            return "no life: nothing slides under a force at any face, so none reaches its limit"
        last, name = worn.states[-1], self.faces[worn.first]
        if worn.reason == "time":
            doubt = "" if self.verdict == "good" else f"; intervals of the rates: {self.verdict}"
            return f"after {time_words(last.time)}: {', '.join(self._worn_by())}; no face reaches its limit{doubt}"
        if worn.life is None or worn.low is None or worn.high is None:
            return (
                f"{self.limit:g} m is not reached: after {time_words(last.time)} {name}, the nearest to its limit, is "
                f"worn by {last.depths[worn.first]:.3g} m; {WHY[worn.reason]}"
            )
        doubt = "" if self.verdict == "good" else f"; intervals of the rates: {self.verdict}"
        return (
            f"life {time_words(worn.life)} ({time_words(worn.low)} to {time_words(worn.high)}, 95 %) until {name} is "
            f"worn by {self.limit:g} m; chance +- {100.0 * worn.chance:.2g} %, blocks +- "
            f"{100.0 * worn.block_error / worn.life:.2g} %; {worn.runs} runs{doubt}"
        )

    def _worn_by(self) -> list[str]:
        """Return the depth of each face at the end, with its interval, in words."""
        ends = zip(self.faces, self.worn.states[-1].depths, *self.worn.depth_interval, strict=True)
        return [f"{name} worn by {depth:.3g} m ({low:.3g} to {high:.3g}, 95 %)" for name, depth, low, high in ends]

    def tables(self) -> list[Table]:
        """Return depths and rates over time."""
        table = Table(
            "time", *(f"{name}: depth (m)" for name in self.faces), *(f"{name}: rate (m/s)" for name in self.faces)
        )
        for state in self.worn.states:
            rates = zip(state.rates.values, state.rates.low, state.rates.high, strict=True)
            table.add_row(
                time_words(state.time),
                *(f"{depth:.4g}" for depth in state.depths),
                *(f"{value:.3g} ({low:.3g} to {high:.3g})" for value, low, high in rates),
            )
        return [table]


def run_life(
    case: Path,
    folder: Path,
    fixed: Sequence[str] = (),
    tolerance: float = 0.02,
    longest: float = inf,
    runs: int = 40,
    overwrite: bool = False,
    progress: Callable[[int, int | None], None] | None = None,
) -> LifeResult:
    """March the gaps of a case until a face is worn to `wear.depth_limit`; resumes where it stopped.

    Args:
        case: Path of the case file.
        folder: Where the files go.
        fixed: Overrides, KEY=VALUE.
        tolerance: Share of the depth of a block that its error may be.
        longest: Time after which the march ends, s.
        runs: At most so many.
        overwrite: Begin anew.
        progress: Called with the number of runs, and how many there may be.

    Raises:
        CaseError: The case has faults, or has some when it is worn.
        UserError: It has no limit, or is no march; or the folder holds another study.
        RunFailed: A run did not pass.
        NotWritten: A file could not be written.
    """
    read = read_case(case, fixed)
    limits = refuse_unworn(read)
    local = PointRates(read) if read.wear is not None and read.wear.growth == "local" else None
    rates = CaseRates(read) if local is None else local
    faces = list(rates.names)
    plan = {"case": json.loads(read.model_dump_json()), "tolerance": tolerance}

    def seen(number: int) -> None:
        if progress is not None:
            progress(number, None)

    with study_folder(folder):
        kept = KeptRuns.of_folder(folder, plan, rates, seen, overwrite)
        blocks, profiles = Blocks(1.0, tolerance, longest, runs), None
        if local is None:
            worn = wear_to_limits(kept, limits, blocks)
        else:
            of_points = wear_to_limits(kept, limits[local.owners], blocks)
            worn, profiles = of_faces(of_points, local.owners), Profiles(local.unworn.system.contact, of_points.states)
        result = LifeResult(folder, read, limits, faces, worn, kept.taken, profiles)
        _write(result)
    return result


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


def _write(result: LifeResult) -> None:
    worn = result.worn
    summary: dict[str, Any] = {
        "reached": worn.life is not None,
        "message": result.headline(),
        "reason": worn.reason,
        "limit": result.limit,
        "limits": result.limits.tolist(),
        "face": None if worn.first is None else result.faces[worn.first],
        "life": worn.life,
        "low": worn.low,
        "high": worn.high,
        "relative_chance": worn.chance,
        "block_error": worn.block_error,
        "depths": {
            name: {"depth": float(depth), "low": float(low), "high": float(high)}
            for name, depth, low, high in zip(result.faces, worn.states[-1].depths, *worn.depth_interval, strict=True)
        },
        "verdict": result.verdict,
        "runs": worn.runs,
        "faces": list(result.faces),
        "states": [_described(state, result) for state in worn.states],
    }
    if result.profiles is not None:
        summary["profiles"] = result.profiles.as_data()
        with study_written(result.folder / PROFILES_FILE):
            write_beside(result.folder / PROFILES_FILE, result.profiles.as_csv())
    with study_written(result.folder / LIFE_FILE):
        write_beside(result.folder / LIFE_FILE, json.dumps(summary, indent=1) + "\n")
    text = io.StringIO()
    names = [f"{name}_{key}" for name in result.faces for key in ("depth", "depth_rate", "rate_low", "rate_high")]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time", *names])
    for state in worn.states:
        columns = np.stack([state.depths, state.rates.values, state.rates.low, state.rates.high], axis=1)
        writer.writerow([state.time, *columns.reshape(-1).tolist()])
    with study_written(result.folder / TABLE_FILE):
        write_beside(result.folder / TABLE_FILE, text.getvalue())


def _described(state: WornState, result: LifeResult) -> dict[str, Any]:
    grown = state.depths if result.profiles is None else np.zeros_like(state.depths)
    return {
        "time": state.time,
        "depths": state.depths.tolist(),
        "depth_rates": state.rates.values.tolist(),
        "low": state.rates.low.tolist(),
        "high": state.rates.high.tolist(),
        "verdicts": list(state.rates.verdicts),
        "errors": state.errors.tolist(),
        "clearances": worn_clearances(worn_case(result.case, list(map(float, grown)))),
    }
