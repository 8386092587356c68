"""The command `gapbeam sweep`."""

from __future__ import annotations

import logging
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress

WIDTH = 160  # columns of the table where there is no terminal to fit it to
LOG = logging.getLogger("gapbeam")


def sweep(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")],
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
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case; may be repeated")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-sweep")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="begin anew")] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes; by default one a core")] = None,
) -> int:
    """Run a case over the values of some keys; goes on where it was interrupted.

    Exit status: 0 all passed, 3 energy was created or 4 not converged at some point, 2 a fault of the input.
    """
    from gapbeam.compare import fraction
    from gapbeam.study_folder import study_folder
    from gapbeam.sweeping.plan import Sweep, chains_of, finished, prepare, read_points
    from gapbeam.sweeping.point import run_chain
    from gapbeam.sweeping.tables import census_table, write_tables
    from postprocess.census import census
    from postprocess.damage import as_written
    from solver.case import Case
    from solver.studies.axes import read_axis
    from solver.studies.side_by_side import side_by_side

    axes = tuple(read_axis(text, "linear", "") for text in keys)
    wanted = Sweep(
        case, tuple(override or ()), axes, zipped, carry or both, both, starts, seed, transient, fraction(tolerance)
    )
    cases = [entry for entry in read_points(wanted).values() if isinstance(entry, Case)]
    folder = output if output is not None else Path("results") / f"{case.stem}-sweep"
    with study_folder(folder):
        done = prepare(wanted, folder, cases, overwrite)
        chains = chains_of(wanted, folder)
        total = sum(len(chain.tasks) for chain in chains)
        if done:
            LOG.info("%d of %d responses are on disk already", done, total)
        console = Console(stderr=True)
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("responses", total=total, completed=done)

            def tick() -> None:
                progress.update(task, completed=len(finished(folder)))

            for _ in side_by_side(run_chain, chains, jobs, tick):
                tick()
        with as_written(folder):
            records = [record for _, record in sorted(finished(folder).items())]
            points = census(records, wanted.tolerance)
            paths = write_tables(folder, records, points)
    screen = Console(soft_wrap=True, highlight=False)
    if not screen.is_terminal:
        screen.width = max(screen.width, WIDTH)
    screen.print(census_table(points))
    for note, count in Counter(note for record in records for note in record["notes"]).most_common(10):
        screen.print(f"note ({count} of {total}): {note}", markup=False)
    failed = [record for record in records if record["exit_status"]]
    for record in failed:
        values = ", ".join(f"{key} = {value}" for key, value in record["values"].items())
        screen.print(f"{values}: {record['verdict']}: {record['message'].splitlines()[0]}", markup=False)
    screen.print("\n".join(map(str, paths)), markup=False)
    several = sum(len(point.branches) > 1 for point in points)
    screen.print(
        f"{total - len(failed)} of {total} responses passed; "
        f"{several} of {len(points)} points have more than one response",
        markup=False,
    )
    return max((int(record["exit_status"]) for record in failed), default=0)
