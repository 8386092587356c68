"""The command `gapbeam stability`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import (
    CaseArgument,
    Overrides,
    SchedulerAddress,
    SlurmOptions,
    StudyCommand,
    WorkerCount,
    progress_bar,
    shipped_kind,
    workers_from,
)

STIFFNESSES, STEPS = "1e10:1e16:4", "1e-5:1e-3:3"
SCHEMES = "discrete-gradient,implicit-midpoint,newmark,hht-alpha,generalized-alpha"


def stability(
    case: CaseArgument,
    stiffness: Annotated[str, typer.Option(help="contact stiffness, Pa/m: a,b,c or first:last:count")] = STIFFNESSES,
    step: Annotated[str, typer.Option(help="time step, s: a,b,c or first:last:count")] = STEPS,
    scheme: Annotated[str, typer.Option(help="schemes, by name")] = SCHEMES,
    vary: Annotated[list[str] | None, typer.Option(metavar="KEY=VALUES", help="any other key; may be repeated")] = None,
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-stability")] = None,
    workers: WorkerCount = None,
    scheduler: SchedulerAddress = None,
    slurm: SlurmOptions = None,
) -> int:
    """Run a case over a grid of stiffness, step and scheme, and draw where it can be trusted."""
    from gapbeam.studies.run_stability import run_stability
    from gapbeam.studies.trials.axes import read_axis

    grid = [f"contact.stiffness={stiffness}", f"time.step={step}", f"time.scheme={scheme}", *(vary or [])]
    folder = output if output is not None else Path("results") / f"{case.stem}-stability"
    crew = workers_from(workers, scheduler, slurm)
    with progress_bar("trials") as bar:
        result = run_stability(case, [read_axis(text) for text in grid], folder, override or [], crew, bar.show)
    print(*result.summaries(), *result.pictures, sep="\n")
    return 0


STUDY = StudyCommand(stability, shipped_kind("stability"))
