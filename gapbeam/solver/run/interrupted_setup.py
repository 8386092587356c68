"""Files of a run that was stopped before its march began."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.versions.installed_versions import versions
from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case
from gapbeam.solver.messages.errors import Interrupted, NotWritten, UserError
from gapbeam.solver.run.output.atomic_files import written
from gapbeam.solver.run.output.results_folder import check_folder, locked, prepare_folder, write_summary
from gapbeam.solver.schema.record_table import SUMMARY_FILE

if TYPE_CHECKING:
    from mpi4py import MPI

LOG = logging.getLogger("gapbeam")


def stopped_words(case: Case, stopped: Interrupted, going_on: bool) -> str:
    """Return the time at which a run was stopped and the next command, in one line.

    Args:
        case: The case.
        stopped: Reason for the stop.
        going_on: Whether it was about to continue from a checkpoint.
    """
    if going_on:
        return f"{stopped}; the checkpoints are as they were, `resume=True` continues from the last one"
    again = "start it again with `overwrite=True`" if isinstance(case.analysis, Periodic) else "`resume=True` starts it"
    return f"{stopped}; there is nothing to keep, {again}"


def left_behind(
    case: Case, folder: Path, comm: MPI.Comm, stopped: Interrupted, resume: bool, started: float
) -> dict[str, Any]:
    """Return the summary of a run that was stopped during its set-up, and write it where no earlier results are.

    Args:
        case: The case.
        folder: Results folder.
        comm: The ranks.
        stopped: Reason for the stop.
        resume: Whether it was to go on with earlier results.
        started: Reading of `time.perf_counter` at its start, s.

    Collective.
    """
    summary: dict[str, Any] = {
        "title": case.title,
        "status": "interrupted",
        "exit_status": stopped.exit_status,
        "message": stopped_words(case, stopped, False),
        "warnings": [],
        "versions": versions(),
        "wall_time": {"total": time.perf_counter() - started},
        "resumed": [],
    }
    try:
        on_rank_zero(comm, lambda: check_folder(folder, overwrite=False))
        with locked(folder, comm):
            on_rank_zero(comm, lambda: _write(folder, summary))
    except (UserError, NotWritten):  # earlier results, or no place: as they were
        summary["message"] = f"{stopped}; {folder} is as it was" + (", `resume=True` continues it" if resume else "")
    LOG.error("%s", summary["message"])
    return summary


def _write(folder: Path, summary: dict[str, Any]) -> None:
    prepare_folder(folder)
    with written(folder / SUMMARY_FILE):
        write_summary(folder, summary)
