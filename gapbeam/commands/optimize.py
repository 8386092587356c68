"""The command `gapbeam optimize`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import Overrides, StudyCommand, print_study, progress_bar, shipped_kind


def optimize(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="what becomes least, free values, and limits (TOML)")],
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<study>")] = None,
) -> int:
    """Find the clearances, stiffnesses or loads at which a figure is least, by exact derivatives of one response.

    Exit status: 0 done, 2 a fault of the input or a response without derivatives, 4 the response ends or no values keep
    the limits, 5 the response is unstable there, 6 results could not be written.
    """
    from gapbeam.interface.case_atlas import repeating_scene
    from gapbeam.studies.optimum.optimum_study import read_optimum_study, run_optimum
    from gapbeam.studies.uncertain.uncertain_file import settings_of_study

    read = read_optimum_study(study)
    folder = output if output is not None else Path("results") / study.stem
    with progress_bar("responses"):
        one = repeating_scene(study.parent / read.case, settings_of_study(study, read.set, override or []))
        result = run_optimum(read, one, folder)
    print_study(result.tables(), [*result.paths, result.headline()])
    return result.exit_status


STUDY = StudyCommand(optimize, shipped_kind("optimum"))
