"""Everything that the paper computes or measures, computed again, as one report."""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gapbeam.meshes.versions.installed_versions import versions
from gapbeam.postprocess.report.blocks import Block, Report, ReportSection, Verdict
from gapbeam.postprocess.report.html_page import write_html
from gapbeam.solver.run.output.results_folder import check_folder
from gapbeam.studies.paper.printed_figures import PAPER
from gapbeam.studies.paper.section_four import section_four
from gapbeam.studies.paper.section_three import section_three
from gapbeam.studies.paper.section_two import section_two
from gapbeam.studies.study_folder import study_folder

MISSED = 5
SECTIONS = {2: section_two, 3: section_three, 4: section_four}
LOG = logging.getLogger("gapbeam")


@dataclass(frozen=True)
class PaperResult:
    """The paper, computed again.

    Attributes:
        page: The report.
        missed: What the report promises and the results do not hold.
    """

    page: Path
    missed: tuple[str, ...]

    @property
    def exit_status(self) -> int:
        """0, or 5 where a result does not hold what the report promises."""
        return MISSED if self.missed else 0


def run_paper(folder: Path, overwrite: bool = False) -> PaperResult:
    """Compute the paper again, but for what the folder holds already, and write the report.

    Args:
        folder: Where everything goes.
        overwrite: Begin anew.

    Raises:
        UserError: The folder holds something else or cannot be written.
    """
    check_folder(folder, overwrite=False)
    with study_folder(folder):
        if overwrite:
            for number in SECTIONS:
                shutil.rmtree(folder / f"section-{number}", ignore_errors=True)
        clock, sections, seconds = time.perf_counter(), list[ReportSection](), dict[str, float]()
        for number, make in SECTIONS.items():
            began = time.perf_counter()
            LOG.info("section %d", number)
            sections.append(make(folder / f"section-{number}"))
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
        page = write_html(report, folder / "report.html")
    LOG.info("written in %.0f s", time.perf_counter() - clock)
    return PaperResult(page, tuple(_errors(sections)))


def _errors(blocks: Sequence[Block]) -> list[str]:
    """Return the texts of verdicts that are errors, in all sections."""
    found: list[str] = []
    for block in blocks:
        if isinstance(block, ReportSection):
            found += _errors(block.blocks)
        elif isinstance(block, Verdict) and block.level == "error":
            found.append(block.text)
    return found
