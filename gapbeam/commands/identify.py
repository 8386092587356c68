"""The command `gapbeam identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import (
    Overrides,
    Overwrite,
    SchedulerAddress,
    SlurmOptions,
    StudyCommand,
    WorkerCount,
    print_study,
    progress_bar,
    shipped_kind,
    workers_from,
)


def identify(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="what is unknown and what was measured (TOML)")],
    override: Overrides = None,
    leave_one_out: Annotated[
        bool, typer.Option("--leave-one-out", help="predict each fitted measurement from the others too")
    ] = False,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<file>")] = None,
    workers: WorkerCount = None,
    scheduler: SchedulerAddress = None,
    slurm: SlurmOptions = None,
    overwrite: Overwrite = False,
) -> int:
    """Find unknown keys of a case from measured values, and how well they are known; resumes where it stopped.

    Exit status: 0 done, 2 a fault of the input, 4 the best values themselves did not pass, 5 the fit misses
    search.tolerance, or the measurements by far more than their standard errors.
    """
    from gapbeam.studies.identification.identification_file import read_identification
    from gapbeam.studies.identification.run_identification import run_identification

    crew = workers_from(workers, scheduler, slurm)
    problem = read_identification(file, override or [])
    folder = output if output is not None else Path("results") / file.stem
    with progress_bar("search") as bar:
        result = run_identification(
            problem,
            folder,
            leave_one_out,
            crew,
            overwrite,
            lambda words, done, total: bar.show(done, total, words),
        )
    remark = result.remark()
    print_study(result.tables(), [*result.paths, *([] if remark is None else [remark])], width=180)
    return result.exit_status


STUDY = StudyCommand(identify, shipped_kind("identification"))
