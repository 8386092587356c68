"""The report on a span of time of a run: what its records show, and nothing of the rest of the run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Report, ReportSection, TableBlock, Words
from gapbeam.postprocess.report.sections.impacts_section import impacts_section
from gapbeam.postprocess.report.sections.peak_rows import peak_rows
from gapbeam.postprocess.report.sections.run_section import case_section, meta_of, sections_of_records
from gapbeam.postprocess.report.sections.statistics_section import statistics_section
from gapbeam.postprocess.report.sections.verdict_section import FIGURE_HEADS, run_verdicts
from gapbeam.postprocess.results.span_of_run import SpanOfRun


def span_report(run: SpanOfRun, statistics: Mapping[str, Any] | None, command: str) -> Report:
    """Return the report on a span of a run: how the run ended, peaks, statistics, motion, spectra, contact, impacts.

    Args:
        run: The span.
        statistics: Of its records, as the summary of a run has them; None: the run has none.
        command: That makes the report.

    Raises:
        ResultsError: A file of the results cannot be read.
    """
    first, last = run.times
    span = f"from t = {first:.6g} to {last:.6g} s"
    words = (
        f"Records {span}, of a run to {float(run.whole_history['time'][-1]):.6g} s. Energy, margins, wear and the "
        "loads that were generated belong to the whole run: see the report without `--from` and `--to`."
    )
    opening: list[Block] = [*run_verdicts(run), Words(words)]
    if rows := peak_rows(run.history):
        opening.append(TableBlock(f"Results {span}", FIGURE_HEADS, rows))
    chance = statistics_section({"statistics": statistics}) if statistics else None
    impacts = impacts_section(run.impacts, last - first, span)
    rest = [chance, *sections_of_records(run, command), impacts, case_section(run)]
    sections = [ReportSection("Summary", "summary", opening), *(one for one in rest if one is not None)]
    return Report(f"{run.title}, {span}", f"Run in `{run.folder}`", sections, meta_of(run, command))
