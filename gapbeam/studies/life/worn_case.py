"""Case with worn supports (larger gaps, worn faces, other noise in its loads), and runs of a life that are on disk.

A study that is called again uses the rates of these runs, and continues after them.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.report.study_json import read_records
from gapbeam.solver.case.case import Case
from gapbeam.solver.run.output.wear_file import angles
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.support_tables import BaseAndGland, OneSupport
from gapbeam.solver.system.semi_discrete import ContactOperator
from gapbeam.studies.life.worn_march import DepthRates, RateAt, Worn, WornState
from gapbeam.studies.study_folder import write_json


def worn_case(case: Case, depths: Sequence[float], number: int = 0) -> Case:
    """Return a case with worn faces.

    A hole, a polygon or a profile grows by its depth all around. Both planes of a slot move away from the beam, each
    by its own depth; those of the base and the gland likewise, except that heights are still meant from the base.

    Args:
        case: The case, not worn.
        depths: Depths of all faces, in the order of `Case.layout`, m.
        number: Number of the run: each has noise of its own.
    """
    left = iter(depths)
    parts = {id(one): [next(left) for _ in one.faces] for one in case.layout.supports}
    support = case.support
    changed: OneSupport | tuple[OneSupport, ...]
    if isinstance(support, BaseAndGland):
        changed = _worn(support, parts[id(support)])
    else:
        changed = tuple(_worn(one, parts[id(one)]) for one in support)
    loads = tuple(load.with_other_noise(number) for load in case.load)
    return case.model_copy(update={"support": changed, "load": loads})


def worn_clearances(case: Case) -> dict[str, float]:
    """Return the clearance of each support by its name, m."""
    return {one.name: one.clearance for one in Layout.of(case.support).supports}


def _worn(support: OneSupport, depths: Sequence[float]) -> OneSupport:
    clearance = support.clearance + sum(depths)
    if isinstance(support, BaseAndGland) or len(depths) == 1:
        return support.model_copy(update={"clearance": clearance})
    below, above = depths
    return support.model_copy(update={"clearance": clearance, "offset": support.offset + 0.5 * (above - below)})


PROFILES_FILE = "profiles.csv"
HEADS = ("face", "x (m)", "y (m)", "angle (deg)", "area (m^2)")


@dataclass(frozen=True)
class Profiles:
    """The depths of all contact points over a life.

    Attributes:
        contact: Their places and faces.
        states: States of the march, with depths of points.
    """

    contact: ContactOperator
    states: Sequence[WornState]

    def as_csv(self) -> str:
        """Return a line a point: where it is, and its depth at the end of each block."""
        text, contact = io.StringIO(), self.contact
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*HEADS, *(f"depth at {state.time!r} s (m)" for state in self.states)])
        places = np.column_stack([contact.positions[:, :2], angles(contact), contact.weights])
        depths = np.column_stack([state.depths for state in self.states])
        for face, place, depth in zip(contact.faces, places, depths, strict=True):
            writer.writerow([contact.face_names[face], *map(float, place), *map(float, depth)])
        return text.getvalue()

    def as_data(self) -> dict[str, Any]:
        """Return the last depths by face, with places, as plain data."""
        contact, turned, last = self.contact, angles(self.contact), self.states[-1]
        return {
            name: {
                "x": contact.positions[mine, 0].tolist(),
                "angle": turned[mine].tolist(),
                "depth": last.depths[mine].tolist(),
            }
            for number, name in enumerate(contact.face_names)
            for mine in [contact.faces == number]
        }


def of_faces(worn: Worn, owners: np.ndarray) -> Worn:
    """Return the wear of faces from that of their points: each face as its deepest point, the fastest of equals.

    Args:
        worn: Wear of points.
        owners: Index of the face of each point, (m,).
    """
    first = None if worn.first is None else int(owners[worn.first])
    return replace(worn, states=tuple(_deepest(state, owners) for state in worn.states), first=first)


def _deepest(state: WornState, owners: np.ndarray) -> WornState:
    order = np.lexsort((state.rates.values, state.depths))
    chosen = np.array([order[owners[order] == face][-1] for face in range(int(owners.max()) + 1)])
    rates = state.rates
    found = DepthRates(
        rates.values[chosen], rates.low[chosen], rates.high[chosen], tuple(rates.verdicts[point] for point in chosen)
    )
    return WornState(state.time, state.depths[chosen], found, state.errors[chosen])


YEAR = 365.25 * 86_400.0  # s, a Julian year
UNITS = {"years": YEAR, "days": 86_400.0, "h": 3600.0, "s": 1.0}
LETTERS = {"y": YEAR, "d": 86_400.0, "h": 3600.0, "m": 60.0, "s": 1.0, "": 1.0}


def time_words(seconds: float) -> str:
    """Return a time in the largest unit of which there is one at least: 12.3 years, 40 days, 3 h, 20 s."""
    unit = next((name for name, size in UNITS.items() if seconds >= size), "s")
    return f"{seconds / UNITS[unit]:.3g} {unit}"


def long_time(text: str) -> float | None:
    """Return a time such as 40y, 300d, 2000h or 90 (seconds), s; None: it is none."""
    parts = re.fullmatch(r"(\d+(?:\.\d*)?(?:e\d+)?)([ydhms]?)", text.strip())
    if parts is None or float(parts[1]) <= 0.0:
        return None
    return float(parts[1]) * LETTERS[parts[2]]


RUNS_FILE = "runs.json"
KEYS = ("depths", "values", "low", "high", "verdicts")


@dataclass
class KeptRuns:
    """Rates of runs, on disk as soon as they are known.

    Attributes:
        path: Path of the file.
        rate_at: Function that runs the case.
        seen: Called with the number of runs so far.
        records: Records of the runs, one after the other.
        taken: Number of runs found on disk.
    """

    path: Path
    rate_at: RateAt
    seen: Callable[[int], None]
    records: list[dict[str, Any]] = field(default_factory=list)
    taken: int = 0

    @classmethod
    def of_folder(cls, folder: Path, rate_at: RateAt, seen: Callable[[int], None]) -> KeptRuns:
        """Return the runs of a folder, or none where it is new.

        Args:
            folder: Folder of the study.
            rate_at: Function that runs the case.
            seen: Called with the number of runs so far.

        Raises:
            ResultsError: Its contents cannot be read.
        """
        runs = folder / RUNS_FILE
        return cls(runs, rate_at, seen, read_records(runs, KEYS) if runs.exists() else [])

    def __call__(self, depths: np.ndarray, number: int) -> DepthRates:
        """Return the rates of a run, from the disk or from the run itself; errors are those of the run."""
        if number < len(self.records) and np.array_equal(self.records[number]["depths"], depths):
            self.taken += 1
        else:
            found = self.rate_at(depths, number)
            ends = {name: getattr(found, name).tolist() for name in ("values", "low", "high")}
            record = {"depths": depths.tolist(), **ends, "verdicts": list(found.verdicts)}
            self.records = [*self.records[:number], record]
            write_json(self.path, self.records)
        self.seen(number + 1)
        one = self.records[number]
        values, low, high = (np.array(one[name], dtype=float) for name in ("values", "low", "high"))
        return DepthRates(values, low, high, tuple(one["verdicts"]))
