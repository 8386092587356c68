"""The command `gapbeam compare`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import click
import typer
from rich.console import Console

WIDTH = 120  # columns of the tables where there is no terminal to fit them to
ResultsFolder = Annotated[Path, typer.Argument(help="results folder of a run")]


def fraction(text: str) -> float:
    """Read a tolerance, 2% or 0.02.

    Raises:
        BadParameter: Not a number between 0 and 1.
    """
    given = text.strip()
    try:
        value = float(given[:-1]) / 100.0 if given.endswith("%") else float(given)
    except ValueError:
        value = -1.0
    if not 0.0 < value < 1.0:
        raise click.BadParameter(f'found "{text}"; expected a fraction such as 2% or 0.02, between 0 and 1')
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
    from gapbeam.study_folder import study_folder
    from postprocess.comparison import DISAGREE
    from postprocess.comparison import compare as lay_side_by_side
    from postprocess.comparison_report import as_data, as_tables, draw_comparison
    from postprocess.damage import as_written
    from postprocess.results import open_results

    limit = fraction(tolerance)
    folder = output if output is not None else Path("results") / f"{a.resolve().name}-against-{b.resolve().name}"
    data, picture = folder / "comparison.json", folder / "comparison.png"
    with study_folder(folder), as_written(a, b):
        found = lay_side_by_side(open_results(a), open_results(b), limit, after)
        data.write_text(json.dumps(as_data(found), indent=1, allow_nan=False) + "\n", encoding="utf-8")
        draw_comparison(found, picture)
    console = Console(soft_wrap=True, highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, WIDTH)
    for table in as_tables(found):
        console.print(table)
    for note in found.notes:
        console.print(f"note: {note}", markup=False)
    console.print(f"{data}\n{picture}", markup=False)
    console.print(found.verdict, markup=False)
    return 0 if found.agree else DISAGREE
