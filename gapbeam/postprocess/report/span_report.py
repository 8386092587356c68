"""The report on a span of time of a run: what its records show, and nothing of the rest of the run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Report, ReportSection, TableBlock, Verdict, Words
from gapbeam.postprocess.report.sections.energy_section import energy_of_span
from gapbeam.postprocess.report.sections.impacts_section import impacts_section
from gapbeam.postprocess.report.sections.peak_rows import peak_rows
from gapbeam.postprocess.report.sections.run_section import case_section, meta_of, sections_of_records
from gapbeam.postprocess.report.sections.scene_section import scene_of
from gapbeam.postprocess.report.sections.statistics_section import statistics_section
from gapbeam.postprocess.report.sections.verdict_section import FIGURE_HEADS, run_verdicts
from gapbeam.postprocess.report.sections.wear_section import wear_section
from gapbeam.postprocess.results.span_of_run import SpanOfRun
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.signals.signal import SignalError

NO_SCENE = (
    "There is no moving scene: the run left fewer than three fields of the motion in this span. A longer span, or a "
    "run with a smaller `output.fields_interval`, has them."
)


def span_report(
    run: SpanOfRun, statistics: Mapping[str, Any] | None, command: str, wear: Mapping[str, Any] | None = None
) -> Report:
    """Return the report on a span of a run: how the run ended, and what its records and fields show of the span.

    Args:
        run: The span.
        statistics: Of its records, as the summary of a run has them; None: the run has none.
        command: That makes the report.
        wear: Of the span, as the summary of a run has that of the run; None: nothing wears.

    Raises:
        ResultsError: A file of the results cannot be read.
    """
    first, last = run.times
    span = f"from t = {first:.6g} to {last:.6g} s"
    words = (
        f"Records {span}, of a run to {float(run.whole_history['time'][-1]):.6g} s. Gates, margins, maps of wear and "
        "the loads that were generated belong to the whole run: see the report without `--from` and `--to`."
    )
    opening: list[Block] = [*run_verdicts(run), *_scene(run, command), Words(words)]
    if rows := peak_rows(run.history):
        opening.append(TableBlock(f"Results {span}", FIGURE_HEADS, rows))
    chance = statistics_section({"statistics": statistics}) if statistics else None
    impacts = impacts_section(run.impacts, last - first, span)
    worn = None if wear is None else wear_section({"wear": wear}, {}, command, since=f"t = {first:.6g} s")
    records = sections_of_records(run, command)
    rest = [chance, worn, *records, impacts, *_energy(run, command), case_section(run)]
    sections = [ReportSection("Summary", "summary", opening), *(one for one in rest if one is not None)]
    return Report(f"{run.title}, {span}", f"Run in `{run.folder}`", sections, meta_of(run, command))


def _scene(run: SpanOfRun, command: str) -> list[Block]:
    """Return the moving scene of the fields in the span, or why there is none."""
    try:
        scene = scene_of(run, command, run.begin, run.end)
    except (ResultsError, SignalError) as fault:
        return [Verdict("warning", f"There is no moving scene: {fault}")]
    return [Words(NO_SCENE)] if scene is None else [scene]


def _energy(run: SpanOfRun, command: str) -> list[ReportSection]:
    try:
        found = energy_of_span(run.history, command)
    except SignalError as fault:
        return [ReportSection("Energy", "energy", [Verdict("error", str(fault))])]
    return [] if found is None else [found]
