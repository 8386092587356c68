"""The command `gapbeam paper`: everything that the paper computes or measures, computed again, as one report."""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from postprocess.report.blocks import Block

FOLDER = Path("results/paper")
MISSED = 5
SECTIONS = (2, 3, 4)
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
    from gapbeam.paper.printed import PAPER
    from gapbeam.paper.section_four import section_four
    from gapbeam.paper.section_three import section_three
    from gapbeam.paper.section_two import section_two
    from gapbeam.report import tell_page
    from gapbeam.study_folder import study_folder
    from postprocess.report.blocks import Report, Section
    from postprocess.report.html import write_html
    from postprocess.report.pdf import find_browser
    from solver.output.folder import check_folder
    from solver.output.summary import versions

    check_folder(output, overwrite=False)
    with study_folder(output):
        if overwrite:
            for number in SECTIONS:
                shutil.rmtree(output / f"section-{number}", ignore_errors=True)
        if pdf:
            find_browser()  # it lacks before the work, not after
        clock, sections, seconds = time.perf_counter(), list[Section](), dict[str, float]()
        for number, make in zip(SECTIONS, (section_two, section_three, section_four), strict=True):
            began = time.perf_counter()
            LOG.info("section %d", number)
            sections.append(make(output / f"section-{number}"))
            seconds[f"section {number}"] = time.perf_counter() - began
        meta = {
            "paper": PAPER,
            "made by": "environment/run gapbeam paper",
            "versions": ", ".join(f"{name} {value}" for name, value in versions().items()),
            "wall time (s)": ", ".join(f"{name} {value:.0f}" for name, value in seconds.items()),
        }
        report = Report(
            "A beam with clearance: Li et al. (2013), computed again",
            "Every figure and table of the paper beside what gapbeam computes, with the deviation, and the command "
            "that makes it.",
            sections,
            meta,
        )
        tell_page(write_html(report, output / "report.html"), pdf)
    LOG.info("written in %.0f s", time.perf_counter() - clock)
    missed = _errors(sections)
    for text in missed:
        LOG.error("%s", text)
    return MISSED if missed else 0


def _errors(blocks: Sequence[Block]) -> list[str]:
    """Return the texts of verdicts that are errors, in all sections."""
    from postprocess.report.blocks import Section, Verdict

    found: list[str] = []
    for block in blocks:
        if isinstance(block, Section):
            found += _errors(block.blocks)
        elif isinstance(block, Verdict) and block.level == "error":
            found.append(block.text)
    return found
