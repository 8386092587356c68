"""The command `gapbeam report`: one page, and its PDF, of any results folder or of several."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    results: Annotated[list[Path], typer.Argument(metavar="RESULTS...", help="folders of runs, sweeps or studies")],
    output: Annotated[Path | None, typer.Option(help="page to write, *.html; by default RESULTS/report.html")] = None,
    pdf: Annotated[
        bool | None, typer.Option("--pdf/--no-pdf", help="print it too; by default where a browser is found")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace an earlier report")] = False,
    begin: Annotated[float | None, typer.Option("--from", help="first time of a run that is looked at, s")] = None,
    end: Annotated[float | None, typer.Option("--to", help="last time, s")] = None,
) -> int:
    """Write a report on results: one page that works offline, and a PDF.

    Exit status: 0 written, 2 a fault of the input, or no browser for a PDF that was asked for.
    """
    from gapbeam.commands.study_choice import report_kinds
    from gapbeam.studies.report.write_report import write_report

    print(*write_report(results, report_kinds(), output, pdf, overwrite, begin, end), sep="\n")
    return 0
