"""The command `gapbeam compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import StudyCommand, print_study, shipped_kind
from gapbeam.process.usage_errors import BadParameter

ResultsFolder = Annotated[Path, typer.Argument(help="results folder of a run")]


def fraction(text: str, option: str | None = None) -> float:
    """Read a tolerance, 2% or 0.02, behind an option.

    Raises:
        BadParameter: Not a number between 0 and 1.
    """
    given = text.strip()
    try:
        value = float(given[:-1]) / 100.0 if given.endswith("%") else float(given)
    except ValueError:
        value = -1.0
    if not 0.0 < value < 1.0:
        raise BadParameter(
            f'found "{text}"; expected a fraction such as 2% or 0.02, between 0 and 1', param_hint=option
        )
    return value


def compare(
    a: ResultsFolder,
    b: ResultsFolder,
    tolerance: Annotated[str, typer.Option(help="largest difference that counts as agreement")] = "1%",
    after: Annotated[
        float | None, typer.Option(help="end of the transient, s; by default found in the records")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<A>-against-<B>")] = None,
) -> int:
    """Lay two runs side by side: waveforms, figures, costs and a verdict.

    Exit status: 0 they agree, 5 they do not, 2 they cannot be compared.
    """
    from gapbeam.studies.compare_folders import compare_folders, comparison_folder

    limit = fraction(tolerance)
    result = compare_folders(a, b, output if output is not None else comparison_folder(a, b), limit, after)
    notes = [f"note: {note}" for note in result.comparison.notes]
    print_study(result.tables(), [*notes, result.data, result.picture, result.headline()], width=120)
    return result.exit_status


STUDY = StudyCommand(compare, shipped_kind("comparison"))
