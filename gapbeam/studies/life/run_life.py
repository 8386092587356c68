"""The life of the supports of a case, or of the pairs of a file of structures: runs on gaps that grow, block by block.

It ends where a face is worn to its limit. Wear rates on given gaps follow from the statistics of one run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from gapbeam.postprocess.display_units import size_words
from gapbeam.solver.case.reading.case_reader import is_scene, read_case
from gapbeam.solver.messages.errors import RangeNotCovered
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.scene_file.scene_reader import scene_file
from gapbeam.studies.life.case_rates import CaseRates, PointRates, SceneRates
from gapbeam.studies.life.worn_case import PROFILES_FILE, RUNS_FILE, KeptRuns, Profiles, of_faces, time_words
from gapbeam.studies.life.worn_march import Blocks, Worn, WornState, wear_to_limits
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import StudyPlan, study_folder, study_written, write_json, write_table
from gapbeam.studies.trials.scene_subject import SceneSubject

LIFE_FILE, TABLE_FILE = "life.json", "life.csv"
ORDER = ("good", "no event", "biased", "too short", "not settled")
WHY = {
    "time": "the time that was asked for was reached",
    "runs": "as many runs were made as allowed; more of them go on where this ended",
    "nothing slides": "no face slides any more under a force",
}


FaceRates = CaseRates | SceneRates


@dataclass(frozen=True, repr=False)
class LifeResult(PrintedResult):
    """Life of the supports of a case, or of the pairs of a file of structures.

    Attributes:
        folder: Folder of its files.
        rates: Runner of marches on worn gaps.
        limits: Depth at which the life of each face ends, (faces,), m.
        faces: Names of the faces.
        worn: Result of the march.
        kept: Number of runs found on disk.
        profiles: Depths of all contact points, where each grows by itself; depths of faces are then the deepest.
    """

    folder: Path
    rates: FaceRates
    limits: np.ndarray
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
                f"{size_words(self.limit)} is not reached: after {time_words(last.time)} {name}, the nearest to its "
                f"limit, is worn by {size_words(last.depths[worn.first], 3)}; {WHY[worn.reason]}"
            )
        doubt = "" if self.verdict == "good" else f"; intervals of the rates: {self.verdict}"
        return (
            f"life {time_words(worn.life)} ({time_words(worn.low)} to {time_words(worn.high)}, 95 %) until {name} is "
            f"worn by {size_words(self.limit)}; chance +- {100.0 * worn.chance:.2g} %, blocks +- "
            f"{100.0 * worn.block_error / worn.life:.2g} %; {counted(worn.runs, 'run')}{doubt}"
        )

    def _worn_by(self) -> list[str]:
        """Return the depth of each face at the end, with its interval, in words."""
        ends = zip(self.faces, self.worn.states[-1].depths, *self.worn.depth_interval, strict=True)
        words = ((name, *(size_words(depth, 3) for depth in depths)) for name, *depths in ends)
        return [f"{name} worn by {depth} ({low} to {high}, 95 %)" for name, depth, low, high in words]

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
    """March gaps until a face is worn to `wear.depth_limit`; resumes where it stopped.

    Args:
        case: Path of a case or a file of structures.
        folder: Folder for the files.
        fixed: Overrides, KEY=VALUE.
        tolerance: Share of the depth of a block that its error may be.
        longest: Time after which the march ends, s.
        runs: Largest number of runs.
        overwrite: Begin anew.
        progress: Called with the number of runs, and how many there may be.

    Raises:
        CaseError: The case has faults, or has some when it is worn.
        UserError: The case has no limit, or is no march; or the folder holds another study.
        RunFailed: A run did not pass.
        NotWritten: A file could not be written.
    """
    rates = _rates_of(case, fixed)
    limits, local = rates.limits, rates if isinstance(rates, PointRates) else None
    faces = list(rates.names)
    plan = StudyPlan({"case": rates.inputs, "tolerance": tolerance}, overwrite, (RUNS_FILE,))

    def seen(number: int) -> None:
        if progress is not None:
            progress(number, None)

    with study_folder(folder, plan=plan):
        kept = KeptRuns.of_folder(folder, rates, seen)
        blocks, profiles = Blocks(1.0, tolerance, longest, runs), None
        if local is None:
            worn = wear_to_limits(kept, limits, blocks)
        else:
            of_points = wear_to_limits(kept, limits[local.owners], blocks)
            worn, profiles = of_faces(of_points, local.owners), Profiles(local.unworn.system.contact, of_points.states)
        result = LifeResult(folder, rates, limits, faces, worn, kept.taken, profiles)
        _write(result)
    return result


def _rates_of(case: Path, fixed: Sequence[str]) -> FaceRates:
    if is_scene(case):
        return SceneRates(SceneSubject(scene_file(case, fixed)))
    read = read_case(case, fixed)
    return PointRates(read) if read.wear is not None and read.wear.growth == "local" else CaseRates(read)


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
    write_json(result.folder / LIFE_FILE, summary)
    names = [f"{name}_{key}" for name in result.faces for key in ("depth", "depth_rate", "rate_low", "rate_high")]
    rows = [
        (one.time, *np.stack([one.depths, one.rates.values, one.rates.low, one.rates.high], axis=1).ravel().tolist())
        for one in worn.states
    ]
    write_table(result.folder / TABLE_FILE, ("time", *names), rows)


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
        "clearances": result.rates.clearances(grown),
    }
