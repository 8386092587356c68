"""Resume of a run in a results folder: whether it is possible, and from which checkpoint."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

from mpi4py import MPI

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.case_fingerprint import FREE
from gapbeam.solver.run.checkpoint.checkpoints import Left, last_checkpoint, refuse_another_case
from gapbeam.solver.run.checkpoint.earlier_summary import earlier_summary
from gapbeam.solver.run.run_consumers import steps_between

LOG = logging.getLogger("gapbeam")


def refuse_to_resume(case: Case) -> None:
    """Refuse a case whose runs have no checkpoints.

    Raises:
        UserError: It looks for a periodic response.
    """
    if isinstance(case.analysis, Periodic):
        raise UserError(
            '`resume=True` with analysis.type = "periodic": a search has no checkpoints; expected a transient; '
            "start again with `overwrite=True`, or with a shorter march before the search (time.end)"
        )


def find_left(folder: Path, case: Case, model: Model, comm: MPI.Comm) -> Left | dict[str, Any] | None:
    """Return the state in which the run in a results folder stopped.

    Args:
        folder: Results folder, held by this run.
        case: The case that shall go on, as it was read.
        model: Its model, found anew.
        comm: Its ranks.

    Returns:
        Where to go on; the summary of a run that is done; or None where a run has not come to its first checkpoint, or
        there is none, and the run starts.

    Raises:
        UserError: The case differs from the one that was run, or no checkpoint can be read.

    Collective.
    """
    summary: dict[str, Any] = on_rank_zero(comm, lambda: earlier_summary(folder))
    if summary.get("status") == "completed":
        refuse_another_case(folder, model, comm, frozenset(FREE - {"time.end"}))
        return summary
    left = last_checkpoint(folder, case, model, comm, steps_between(model))
    if left is None:
        refuse_another_case(folder, model, comm, frozenset(FREE))
        LOG.info("%s has no checkpoint: the run starts", folder)
    return left
