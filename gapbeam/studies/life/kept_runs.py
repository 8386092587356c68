"""Runs of a life that are on disk: a study that is called again uses their rates, and continues after them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.report.study_json import read_object, read_records
from gapbeam.solver.errors import UserError
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.studies.life.worn_march import Array, DepthRates, RateAt
from gapbeam.studies.study_folder import REMEDY, differing, study_written

PLAN_FILE, RUNS_FILE = "plan.json", "runs.json"
KEYS = ("depths", "values", "low", "high", "verdicts")


@dataclass
class KeptRuns:
    """Rates of runs, on disk as soon as they are known.

    Attributes:
        path: Of the file.
        rate_at: Function that runs the case.
        seen: Called with the number of runs so far.
        records: Of the runs, one after the other.
        taken: Number of runs found on disk.
    """

    path: Path
    rate_at: RateAt
    seen: Callable[[int], None]
    records: list[dict[str, Any]] = field(default_factory=list)
    taken: int = 0

    @classmethod
    def of_folder(
        cls, folder: Path, plan: dict[str, Any], rate_at: RateAt, seen: Callable[[int], None], overwrite: bool
    ) -> KeptRuns:
        """Return the runs of a folder, or none where it is new.

        Args:
            folder: Of the study.
            plan: Inputs of the runs.
            rate_at: Function that runs the case.
            seen: Called with the number of runs so far.
            overwrite: Forget what is there.

        Raises:
            UserError: The folder holds the life of another case.
            ResultsError: Its contents cannot be read.
        """
        path, runs = folder / PLAN_FILE, folder / RUNS_FILE
        if path.exists() and not overwrite:
            if words := differing(read_object(path, remedy=REMEDY), plan):
                raise UserError(
                    f"{folder} holds the life of another case: {words}; expected the same case and options to go on "
                    "with it. Choose another `output=`, or pass `overwrite=True` to begin anew"
                )
        else:
            runs.unlink(missing_ok=True)
            with study_written(path):
                write_beside(path, json.dumps(plan, indent=1) + "\n")
        return cls(runs, rate_at, seen, read_records(runs, KEYS) if runs.exists() else [])

    def __call__(self, depths: Array, number: int) -> DepthRates:
        """Return the rates of a run, from the disk or from the run itself; errors as in what runs the case."""
        if number < len(self.records) and np.array_equal(self.records[number]["depths"], depths):
            self.taken += 1
        else:
            found = self.rate_at(depths, number)
            ends = {name: getattr(found, name).tolist() for name in ("values", "low", "high")}
            record = {"depths": depths.tolist(), **ends, "verdicts": list(found.verdicts)}
            self.records = [*self.records[:number], record]
            with study_written(self.path):
                write_beside(self.path, json.dumps(self.records, indent=1) + "\n")
        self.seen(number + 1)
        one = self.records[number]
        values, low, high = (np.array(one[name], dtype=float) for name in ("values", "low", "high"))
        return DepthRates(values, low, high, tuple(one["verdicts"]))
