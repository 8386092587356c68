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
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.worker_memory import worker_memory
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import study_folder
from gapbeam.studies.sweep.seed_ensembles import Ensemble, ensemble_words, ensembles_of
from gapbeam.studies.sweep.sweep_plan import (
    Chain,
    Sweep,
    chains_of,
    finished,
    point_file,
    prepare,
    read_points,
    written_responses,
)
from gapbeam.studies.sweep.sweep_point import lost_chain, run_chain
from gapbeam.studies.sweep.sweep_tables import census_table, ensemble_table, write_tables

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
    def ensembles(self) -> list[Ensemble]:
        """Points that differ in the seeds of their noise only, pooled."""
        return ensembles_of(self.records)

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
        words = [f"{total - len(self.failed)} of {total} responses passed", *census_words(self.points)]
        return "; ".join([*words, *map(ensemble_words, self.ensembles)])

    def tables(self) -> list[Table]:
        """Return the table of the different responses, and that of each ensemble of seeds."""
        return [census_table(self.points), *map(ensemble_table, self.ensembles)]


def run_sweep(
    wanted: Sweep,
    folder: Path,
    overwrite: bool = False,
    workers: Workers | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Run a sweep, or go on with the one in the folder.

    Args:
        wanted: The sweep.
        folder: Where it goes.
        overwrite: Begin anew.
        workers: Where; by default one a core of this machine.
        progress: Called with the number of responses that are done, and of all.

    Returns:
        The result; responses that failed are in it, with their exit status.

    Raises:
        CaseError: Every point has faults; those of the first are reported.
        UserError: The case is no march, a state cannot be carried along the last key, or the folder holds another
            sweep or cannot be written.
        ResultsError: What an earlier sweep left cannot be read.
        NotWritten: A response could not be written.
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
                progress(written_responses(folder), total)

        tick()
        missing = [chain for chain in chains if not all(point_file(folder, task).exists() for task in chain.tasks)]
        lost: dict[int, dict[str, Any]] = {}

        def give_up(chain: Chain, words: str) -> int:
            lost.update(lost_chain(chain, words))
            return 0

        with Engine(workers, len(missing), worker_memory(cases), folder) as engine:
            for _ in engine.done(run_chain, missing, tick, give_up):
                tick()
        with as_written(folder):
            records = [record for _, record in sorted((lost | finished(folder)).items())]
            points = census(records, wanted.tolerance)
            return SweepResult(folder, records, points, write_tables(folder, records, points))
