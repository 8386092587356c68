"""The command `gapbeam paper`: everything that the paper computes or measures, computed again, as one report."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.study import StudyCommand

FOLDER = Path("results/paper")
LOG = logging.getLogger("gapbeam")


def paper(
    output: Annotated[Path, typer.Option(help="folder; what is in it already is not computed again")] = FOLDER,
    pdf: Annotated[
        bool | None, typer.Option("--pdf/--no-pdf", help="print it too; by default where a browser is found")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="begin anew")] = False,
) -> int:
    """Reproduce Li et al. (2013), the paper that gapbeam grew from, as one report: about 20 minutes on two cores.

    Goes on where it was interrupted. Exit status: 0 written, 2 a fault of the input, 5 a result that does not hold what
    the report promises, which says so.
    """
    from gapbeam.postprocess.report.pdf_page import find_browser
    from gapbeam.studies.paper.run_paper import run_paper
    from gapbeam.studies.report.write_report import print_page

    if pdf:
        find_browser()  # it lacks before the work, not after
    result = run_paper(output, overwrite)
    print(result.page, *print_page(result.page, pdf), sep="\n")
    for text in result.missed:
        LOG.error("%s", text)
    return result.exit_status


STUDY = StudyCommand(paper)
