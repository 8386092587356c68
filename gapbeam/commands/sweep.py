"""The command `gapbeam sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import (
    CaseArgument,
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
from gapbeam.solver.messages.errors import in_one_line


def sweep(
    case: CaseArgument,
    keys: Annotated[list[str], typer.Argument(metavar="KEY=VALUES...", help="KEY=a,b,c or KEY=first:last:count[:log]")],
    zipped: Annotated[
        bool, typer.Option("--zip", help="values side by side; by default every one with every other")
    ] = False,
    carry: Annotated[
        bool, typer.Option("--carry", help="start from the end of the point before, along the last key")
    ] = False,
    both: Annotated[bool, typer.Option("--both", help="carry upward and downward; implies --carry")] = False,
    starts: Annotated[int, typer.Option(min=1, max=10_000, help="starts: the seat and random kicks")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="of the kicks")] = 0,
    transient: Annotated[
        float | None, typer.Option(min=0.0, help="s before a response counts; by default found in it")
    ] = None,
    tolerance: Annotated[str, typer.Option(help="amplitudes that are the same in the census")] = "2%",
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-sweep")] = None,
    overwrite: Overwrite = False,
    workers: WorkerCount = None,
    scheduler: SchedulerAddress = None,
    slurm: SlurmOptions = None,
) -> int:
    """Run a case over the values of some keys; resumes where it stopped.

    Exit status: 0 all passed, 3 energy was created or 4 not converged at some point, 7 a point ended its workers, 2 a
    fault of the input, 6 results could not be written.
    """
    from gapbeam.commands.compare import fraction
    from gapbeam.studies.sweep.sweep_plan import Sweep
    from gapbeam.studies.sweep.sweep_tables import run_sweep
    from gapbeam.studies.trials.axes import read_axis

    crew = workers_from(workers, scheduler, slurm)
    axes = tuple(read_axis(text, "linear", "") for text in keys)
    wanted = Sweep(
        case, tuple(override or ()), axes, zipped, carry or both, both, starts, seed, transient, fraction(tolerance)
    )
    folder = output if output is not None else Path("results") / f"{case.stem}-sweep"
    with progress_bar("responses") as bar:
        result = run_sweep(wanted, folder, overwrite, crew, bar.show)
    notes = [f"note ({count} of {len(result.records)}): {note}" for note, count in result.notes]
    for record in result.failed:
        values = ", ".join(f"{key} = {value}" for key, value in record["values"].items())
        notes.append(f"{values}: {record['verdict']}: {in_one_line(record['message'])}")
    print_study(result.tables(), [*notes, *result.paths, result.headline()])
    return result.exit_status


STUDY = StudyCommand(sweep, shipped_kind("sweep"))
