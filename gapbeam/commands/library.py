"""The commands `gapbeam library` and `gapbeam estimate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import Overrides, StudyCommand, print_study, progress_bar


def library(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="what is unknown, and what is recorded (TOML)")],
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<study>")] = None,
) -> int:
    """March a library of members over unknown values, for `gapbeam estimate`; resumes where it stopped.

    Exit status: 0 done, 2 a fault of the input, 6 results could not be written.
    """
    from gapbeam.interface.case_atlas import repeating_scene
    from gapbeam.studies.library.library_file import read_library_study, run_library
    from gapbeam.studies.uncertain.uncertain_file import settings_of_study

    read = read_library_study(study)
    folder = output if output is not None else Path("results") / study.stem
    with progress_bar("members") as bar:
        one = repeating_scene(study.parent / read.case, settings_of_study(study, read.set, override or []))
        result = run_library(read, one, folder, lambda done: bar.show(done, read.members))
    print_study(result.tables(), [folder, result.headline()])
    return 0


def estimate(
    library: Annotated[Path, typer.Argument(metavar="LIBRARY", help="folder of gapbeam library")],
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help="CSV, WAV, UFF, by time")],
    unit: Annotated[str, typer.Option(help="of the values: m, mm, um, m/s, mm/s, um/s, m/s2, mm/s2 or g")],
    column: Annotated[str, typer.Option(help="of the values in a text file: number from 1 or name")] = "2",
    time_column: Annotated[str, typer.Option(help="of the times in s: number from 1 or name")] = "1",
    channel: Annotated[int, typer.Option(help="of a WAV file, or data set 58 of a universal file, from 1")] = 1,
    full_scale: Annotated[float | None, typer.Option(help="of a WAV file: value of full scale, in the unit")] = None,
    frequency: Annotated[
        float | None, typer.Option(help="of the load in the recordings, Hz; by default as in the library")
    ] = None,
    at: Annotated[
        str | None, typer.Option(metavar="T1,T2,...", help="times of the recordings, in any unit, such as weeks")
    ] = None,
    limit: Annotated[
        list[str] | None, typer.Option(metavar="PATH=VALUE", help="a limit of a value; may be repeated")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="a CSV file for all estimates")] = None,
) -> int:
    """Estimate the values of a library from recordings, with 95 % intervals; of several, rates and times to limits.

    Exit status: 0 done, 5 a recording lies outside of the library, 2 a fault of the input, 6 the file could not be
    written.
    """
    from gapbeam.solver.messages.errors import UserError
    from gapbeam.studies.library.estimate import estimate as estimated
    from gapbeam.studies.library.estimate import series
    from gapbeam.studies.library.recording import read_recording
    from gapbeam.studies.library.recording_library import read_library
    from gapbeam.studies.study_folder import write_table

    def number(text: str, where: str) -> float:
        try:
            return float(text)
        except ValueError:
            raise UserError(f"{where}: found {text!r}, expected a number") from None

    def place(text: str) -> int | str:
        return int(text) if text.isdigit() else text

    found, period = read_library(library), None
    if frequency is not None:
        if not frequency > 0.0:
            raise UserError(f"--frequency: found {frequency:g}, expected a number of Hz above 0")
        period = 1.0 / frequency
    times = None if at is None else [number(one, "--at") for one in at.split(",")]
    limits = {}
    for text in limit or []:
        path, equals, value = text.partition("=")
        if not equals:
            raise UserError(f"--limit: found {text!r}, expected PATH=VALUE, such as {found.paths[0]}=1e-3")
        limits[path] = number(value, f"--limit {path}")
    estimates = [
        estimated(found, read_recording(
            path, unit, column=place(column), time_column=place(time_column), channel=channel, full_scale=full_scale,
        ), period)
        for path in recordings
    ]  # fmt: skip
    result = series(estimates, times, limits)
    print_study(result.tables(), [])
    if output is not None:
        write_table(output, *result.rows())
    print_study([], [one.headline() for one in [*estimates, *([result] if len(estimates) > 2 else [])]])
    return result.exit_status


STUDY = StudyCommand(library)
ESTIMATE = StudyCommand(estimate)
