"""A sweep from its plan to its tables: points read, responses computed side by side, responses classified."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from gapbeam.postprocess.results.damaged_files import as_written
from gapbeam.postprocess.study_figures.response_census import SweepPoint, census, census_words
from gapbeam.solver.case.case import Case
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import study_folder
from gapbeam.studies.sweep.sweep_plan import Sweep, chains_of, finished, prepare, read_points
from gapbeam.studies.sweep.sweep_point import run_chain
from gapbeam.studies.sweep.sweep_tables import census_table, write_tables
from gapbeam.studies.trials.worker_processes import side_by_side

LOG = logging.getLogger("gapbeam")
Progress = Callable[[int, int], None]


@dataclass(frozen=True, repr=False)
class SweepResult(PrintedResult):
    """What a sweep found.

    Attributes:
        folder: Where its files are.
        records: One record a response, as in sweep.json.
        points: The different responses at each point.
        paths: The tables and the picture.
    """

    folder: Path
    records: Sequence[dict[str, Any]]
    points: Sequence[SweepPoint]
    paths: Sequence[Path]

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Records of the responses that did not pass."""
        return [record for record in self.records if record["exit_status"]]

    @property
    def exit_status(self) -> int:
        """0 where all responses passed, else the largest exit status of a response."""
        return max((int(record["exit_status"]) for record in self.failed), default=0)

    @property
    def notes(self) -> list[tuple[str, int]]:
        """The ten most frequent notes on responses, each with the number of responses that have it."""
        return Counter(note for record in self.records for note in record["notes"]).most_common(10)

    def headline(self) -> str:
        """Return how many responses passed and how many points have several."""
        total = len(self.records)
        return "; ".join([f"{total - len(self.failed)} of {total} responses passed", *census_words(self.points)])

    def tables(self) -> list[Table]:
        """Return the table of the different responses."""
        return [census_table(self.points)]


def run_sweep(
    wanted: Sweep, folder: Path, overwrite: bool = False, jobs: int | None = None, progress: Progress | None = None
) -> SweepResult:
    """Run a sweep, or go on with the one in the folder.

    Args:
        wanted: The sweep.
        folder: Where it goes.
        overwrite: Begin anew.
        jobs: Processes; by default one a core.
        progress: Called with the number of responses that are done, and of all.

    Returns:
        The result; responses that failed are in it, with their exit status.

    Raises:
        CaseError: Every point has faults; those of the first are reported.
        UserError: The case is no march, a state cannot be carried along the last key, or the folder holds another
            sweep or cannot be written.
        ResultsError: What an earlier sweep left cannot be read.
    """
    cases = [entry for entry in read_points(wanted).values() if isinstance(entry, Case)]
    with study_folder(folder):
        done = prepare(wanted, folder, cases, overwrite)
        chains = chains_of(wanted, folder)
        total = sum(len(chain.tasks) for chain in chains)
        if done:
            LOG.info("%d of %d responses are on disk already", done, total)

        def tick() -> None:
            if progress is not None:
                progress(len(finished(folder)), total)

        tick()
        for _ in side_by_side(run_chain, chains, jobs, tick):
            tick()
        with as_written(folder):
            records = [record for _, record in sorted(finished(folder).items())]
            points = census(records, wanted.tolerance)
            return SweepResult(folder, records, points, write_tables(folder, records, points))
