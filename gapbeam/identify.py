"""The command `gapbeam identify`."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress

WIDTH = 180  # columns of the tables where there is no terminal to fit them to
NOT_PASSED, MISSED = 4, 5
LOG = logging.getLogger("gapbeam")


def identify(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="what is unknown and what was measured (TOML)")],
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case; may be repeated")
    ] = None,
    leave_one_out: Annotated[
        bool, typer.Option("--leave-one-out", help="predict each fitted measurement from the others too")
    ] = False,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<file>")] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="side by side; by default one a core")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="begin anew")] = False,
) -> int:
    """Find unknown keys of a case from measured values, and how well they are known; goes on where it was interrupted.

    Exit status: 0 done, 2 a fault of the input, 4 the best values themselves did not pass, 5 the fit misses
    search.tolerance.
    """
    from gapbeam.identification.conclusion import conclude
    from gapbeam.identification.evaluations import Evaluations, prepare
    from gapbeam.identification.misfit import Misfit
    from gapbeam.identification.reading import read_identification
    from gapbeam.identification.results import write_results
    from gapbeam.identification.search import search
    from gapbeam.identification.tables_shown import sentences, tables
    from gapbeam.study_folder import study_folder
    from postprocess.identified import draw_identification
    from solver.case_tables.model import FullModel
    from solver.studies.side_by_side import SideBySide

    problem = read_identification(file, override or [])
    folder = output if output is not None else Path("results") / file.stem
    if isinstance(problem.base.model, FullModel):
        LOG.warning('model "full" marches all DOFs of the mesh in every experiment; try "reduced" or "beam" in [set]')
    with study_folder(folder):
        prepare(problem, folder, overwrite)
        settings = problem.file.search
        console = Console(stderr=True)
        with (
            SideBySide(processes) as workers,
            Progress(console=console, transient=True, disable=not console.is_terminal) as progress,
        ):
            task = progress.add_task("search", total=settings.budget)
            evaluations = Evaluations(
                problem, folder, workers, lambda: progress.update(task, completed=len(misfit.tried))
            )
            misfit = Misfit(problem, evaluations)
            if evaluations.records:
                LOG.info("%d experiments are on disk already", len(evaluations.records))
            search(misfit, problem.start, settings, settings.budget)
            found = conclude(
                problem, evaluations, len(misfit.tried), leave_one_out,
                lambda words: progress.update(task, description=words, total=None),
            )  # fmt: skip
            if evaluations.computed:
                LOG.info("%d experiments were run", evaluations.computed)
        screen = Console(soft_wrap=True, highlight=False)
        if not screen.is_terminal:
            screen.width = max(screen.width, WIDTH)
        if found is None:
            for record in misfit.failures()[:10]:
                values = ", ".join(f"{value:.6g}" for value in record["values"])
                screen.print(f"{values}: {record['verdict']}: {record['message'].splitlines()[0]}", markup=False)
            screen.print("no set of values passed in all experiments: nothing was identified", markup=False)
            return NOT_PASSED
        paths = [*write_results(found, folder), *draw_identification(folder)]
    for table in tables(found):
        screen.print(table)
    for sentence in sentences(found):
        screen.print(sentence, markup=False)
    screen.print("\n".join(map(str, paths)), markup=False)
    if not found.passed:
        screen.print("some experiments did not pass at the best values", markup=False)
        return NOT_PASSED
    rms = found.rms("fit")
    if settings.tolerance is not None and not (math.isfinite(rms) and rms <= settings.tolerance):
        screen.print(f"the fit misses its tolerance: rms {rms:.3g}, search.tolerance = {settings.tolerance:g}",
                     markup=False)  # fmt: skip
        return MISSED
    return 0
