"""Options of a study's command for where it computes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gapbeam.studies.engine.workers import Workers

PANEL = "Workers"
WorkerCount = Annotated[
    int | None,
    typer.Option("--workers", min=1, help="processes; by default one a core; 1: this one alone", rich_help_panel=PANEL),
]
SchedulerAddress = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="of a running Dask scheduler", rich_help_panel=PANEL),
]
SlurmOptions = Annotated[
    str | None,
    typer.Option("--slurm", metavar='"OPTIONS"', help="of sbatch, for jobs with workers", rich_help_panel=PANEL),
]


def workers_from(count: int | None, scheduler: str | None, slurm: str | None) -> Workers:
    """Return the workers that options ask for.

    Raises:
        UserError: Options exclude each other, or Dask is not installed.
    """
    from gapbeam.studies.engine.workers import Workers

    return Workers(count, scheduler, slurm)
