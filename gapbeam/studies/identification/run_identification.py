"""An identification from its file to its tables: the search, how well the unknowns are known, files and pictures."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from gapbeam.postprocess.study_figures.identification_figures import draw_identification
from gapbeam.solver.case.solution_tables import FullModel
from gapbeam.solver.errors import in_one_line
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.worker_memory import worker_memory
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.identification.conclusion import Conclusion, conclude
from gapbeam.studies.identification.evaluations import Evaluations, Record, prepare
from gapbeam.studies.identification.identification_file import Problem
from gapbeam.studies.identification.identification_results import sentences, tables, write_results
from gapbeam.studies.identification.misfit import Misfit, search
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import study_folder

NOT_PASSED, MISSED = 4, 5
SHOWN_FAILURES = 10
LOG = logging.getLogger("gapbeam")
Progress = Callable[[str, int, int | None], None]


@dataclass(frozen=True, repr=False)
class IdentificationResult(PrintedResult):
    """Result of an identification.

    Attributes:
        problem: The identification.
        folder: Where its files are.
        found: The best values and how well they are known; None where no set of values passed in all experiments.
        failures: Records of experiments that failed, where nothing was found.
        paths: The files and pictures.
    """

    problem: Problem
    folder: Path
    found: Conclusion | None
    failures: Sequence[Record]
    paths: Sequence[Path]

    @property
    def values(self) -> dict[str, float]:
        """The best value of each unknown by its key, in the unit of the case file; empty where nothing was found."""
        if self.found is None:
            return {}
        names = [one.unknown.key for one in self.problem.coordinates]
        return dict(zip(names, map(float, self.found.values), strict=True))

    @property
    def exit_status(self) -> int:
        """0; 4 where the best values did not pass; 5 where the fit misses search.tolerance or the standard errors."""
        if self.found is None or not self.found.passed:
            return NOT_PASSED
        return MISSED if self.missed or self.found.known.spread.contradicts else 0

    @property
    def missed(self) -> bool:
        """True where the fit misses the requested tolerance."""
        tolerance = self.problem.file.search.tolerance
        if self.found is None or tolerance is None:
            return False
        rms = self.found.rms("fit")
        return not (math.isfinite(rms) and rms <= tolerance)

    def failure_lines(self) -> list[str]:
        """Return the first failures, one a line."""
        return [
            f"{', '.join(f'{value:.6g}' for value in record['values'])}: {record['verdict']}: "
            f"{in_one_line(record['message'])}"
            for record in self.failures[:SHOWN_FAILURES]
        ]

    def remark(self) -> str | None:
        """Return the reason for an exit status other than 0, else None."""
        if self.found is None:
            return "no set of values passed in all experiments: nothing was identified"
        if not self.found.passed:
            return "some experiments did not pass at the best values"
        if self.missed:
            tolerance = self.problem.file.search.tolerance
            return f"the fit misses its tolerance: rms {self.found.rms('fit'):.3g}, search.tolerance = {tolerance:g}"
        spread = self.found.known.spread
        if spread.contradicts:
            return (
                f"the model misses the measurements by {spread.missed:.3g} given standard errors: check units, bounds "
                "and the keys that are taken as known, or give the standard errors that the figures have"
            )
        return None

    def headline(self) -> str:
        """Return the best values, or why there are none."""
        values = ", ".join(f"{key} = {value:.6g}" for key, value in self.values.items())
        return "; ".join(part for part in (values, self.remark()) if part)

    def tables(self) -> list[Table | str]:
        """Return the tables of measurements, unknowns and sensitivities, and what they say in sentences."""
        if self.found is None:
            return list(self.failure_lines())
        return [*tables(self.found), *sentences(self.found)]


def run_identification(
    problem: Problem,
    folder: Path,
    leave_one_out: bool = False,
    workers: Workers | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> IdentificationResult:
    """Search for the unknowns of an identification, or continue the search in the folder.

    Args:
        problem: The identification, as `identification_file.read_identification` reads it.
        folder: Where it goes.
        leave_one_out: Predict each fitted measurement from the others too.
        workers: Where; by default one a core of this machine.
        overwrite: Begin anew.
        progress: Called with what is done, how many sets of values were tried, and how many may be; None: unknown.

    Raises:
        UserError: The folder holds another identification or cannot be written.
        ResultsError: Results of an earlier search cannot be read.
    """
    if isinstance(problem.base.model, FullModel):
        LOG.warning('model "full" marches all DOFs of the mesh in every experiment; try "reduced" or "beam" in [set]')
    settings = problem.file.search

    def report(words: str, total: int | None) -> None:
        if progress is not None:
            progress(words, len(misfit.tried), total)

    with study_folder(folder):
        prepare(problem, folder, overwrite)
        with Engine(workers, memory=worker_memory([problem.base]), folder=folder) as engine:
            evaluations = Evaluations(problem, folder, engine, lambda: report("search", settings.budget))
            misfit = Misfit(problem, evaluations)
            if evaluations.records:
                LOG.info("%d experiments are on disk already", len(evaluations.records))
            search(misfit, problem.start, settings, settings.budget)
            found = conclude(
                problem, evaluations, len(misfit.tried), leave_one_out, lambda words: report(words, None)
            )  # fmt: skip
            if evaluations.computed:
                LOG.info("%d experiments were run", evaluations.computed)
        if found is None:
            return IdentificationResult(problem, folder, None, misfit.failures(), ())
        paths = [*write_results(found, folder), *draw_identification(folder)]
    return IdentificationResult(problem, folder, found, (), paths)
