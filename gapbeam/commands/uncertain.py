"""The command `gapbeam uncertain`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import Overrides, StudyCommand, print_study, progress_bar, shipped_kind


def uncertain(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="what is uncertain, and limits (TOML)")],
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<study>")] = None,
) -> int:
    """Find figures as distributions for each response, and probabilities; resumes where it stopped.

    Exit status: 0 done, 5 some members did not settle or a limit was not reached, 2 a fault of the input, 6 results
    could not be written.
    """
    from gapbeam.interface.case_atlas import repeating_scene
    from gapbeam.studies.uncertain.uncertain_file import read_uncertain, run_uncertain, settings_of_study

    read = read_uncertain(study)
    folder = output if output is not None else Path("results") / study.stem
    with progress_bar("members") as bar:
        one = repeating_scene(study.parent / read.case, settings_of_study(study, read.set, override or []))
        result = run_uncertain(read, one, folder, lambda done: bar.show(done, read.expected))
    print_study(result.tables(), [folder, result.headline()])
    return result.exit_status


STUDY = StudyCommand(uncertain, shipped_kind("uncertain"))
