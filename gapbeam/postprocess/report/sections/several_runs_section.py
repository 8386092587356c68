"""The report on several runs: figures side by side, waveforms over those of the first, keys that differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gapbeam.postprocess.comparison.comparison_report import as_data
from gapbeam.postprocess.comparison.run_comparison import ComparisonError, RunComparison, compare
from gapbeam.postprocess.comparison.waveform_overlay import is_raw
from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Verdict
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.envelope import envelope
from gapbeam.postprocess.report.markdown_text import sentence
from gapbeam.postprocess.report.sections.comparison_section import comparison_blocks
from gapbeam.postprocess.report.sections.verdict_section import key_figures, run_verdicts, summary_section
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.signals.signal import SignalError


def several_sections(runs: Sequence[Results], command: str) -> list[ReportSection]:
    """Return a comparison of two runs or more, the first against each of the others, and a summary of each.

    Args:
        runs: Two at least.
        command: That makes the report.

    Raises:
        ResultsError: Results that cannot be read.
    """
    names = names_of(runs)
    overview: list[Block] = [*_verdicts(runs, names), _key_table(runs, names), *_case_table(runs, names)]
    sections = [ReportSection("Side by side", "side-by-side", overview)]
    found: dict[str, RunComparison] = {}
    faults: dict[str, str] = {}
    for name, other in zip(names[1:], runs[1:], strict=True):
        try:
            found[name] = compare(runs[0], other)
        except (ComparisonError, SignalError) as fault:
            faults[name] = str(fault)
    waves = _waveforms(found, names[0], command)
    if waves:
        sections.append(ReportSection("Waveforms", "waveforms", waves))
    for number, name in enumerate(names[1:], start=1):
        blocks: list[Block] = (
            comparison_blocks(as_data(found[name]), command) if name in found else [Verdict("warning", faults[name])]
        )
        sections.append(ReportSection(f"{names[0]} against {name}", f"against-{number}", blocks))
    for number, (name, run) in enumerate(zip(names, runs, strict=True), start=1):
        summary = summary_section(run, f"run-{number}")
        sections.append(ReportSection(name, summary.anchor, summary.blocks))
    return sections


def names_of(runs: Sequence[Results]) -> list[str]:
    """Return a name for every run: the name of its folder where those differ, else the whole path."""
    names = [run.folder.name for run in runs]
    return names if len(set(names)) == len(names) else [str(run.folder) for run in runs]


def _verdicts(runs: Sequence[Results], names: Sequence[str]) -> list[Verdict]:
    """Return what is wrong with any of the runs, or that nothing is."""
    bad = [
        Verdict(one.level, f"{name}: {one.text}")
        for name, run in zip(names, runs, strict=True)
        for one in run_verdicts(run)
        if one.level == "error"
    ]
    return bad or [Verdict("passed", f"None of the {len(runs)} runs failed.")]


def _key_table(runs: Sequence[Results], names: Sequence[str]) -> TableBlock:
    tables = [{(row[0], row[2]): row[1] for row in key_figures(run)} for run in runs]
    keys = dict.fromkeys(key for table in tables for key in table)
    rows: list[tuple[Cell, ...]] = [(key[0], key[1], *(table.get(key) for table in tables)) for key in keys]
    return TableBlock("Key figures of the runs", ("figure", "unit", *names), rows)


def _case_table(runs: Sequence[Results], names: Sequence[str]) -> list[TableBlock]:
    """Return the keys in which the cases differ; nothing where one of them cannot be read."""
    try:
        cases = [_flat(run.case) for run in runs]
    except ResultsError:
        return []
    keys = dict.fromkeys(key for case in cases for key in case)
    rows = [(key, *(case.get(key) for case in cases)) for key in keys if len({case.get(key) for case in cases}) > 1]
    return [TableBlock("Keys in which the cases differ", ("key", *names), rows)] if rows else []


def _flat(value: Any, key: str = "") -> dict[str, str]:
    """Return a nested table as texts by dotted key; entries of arrays by their names or numbers."""
    if isinstance(value, Mapping):
        entries = [(str(name), inner) for name, inner in value.items()]
    elif isinstance(value, list) and any(isinstance(entry, Mapping) for entry in value):
        entries = [(str(entry.get("name", place)), entry) for place, entry in enumerate(value)]
    else:
        return {key: str(value)}
    found: dict[str, str] = {}
    for name, inner in entries:
        found |= _flat(inner, f"{key}.{name}" if key else name)
    return found


def _waveforms(found: Mapping[str, RunComparison], first: str, command: str) -> list[Block]:
    """Return a chart of every signal, with a button for every run that is laid over the first."""
    signals = dict.fromkeys(
        (one.name, one.unit) for comparison in found.values() for one in comparison.overlays if not is_raw(one.name)
    )
    charts: list[Block] = []
    for signal, unit in signals:
        shown_unit, factor = shown(unit)
        curves = []
        for name, comparison in found.items():
            for one in comparison.overlays:
                if one.name == signal:
                    curves.append(ChartCurve(first, *envelope(1e3 * one.time, factor * one.a), choice=name))
                    curves.append(ChartCurve("the other", *envelope(1e3 * one.time, factor * one.b), choice=name))
        charts.append(
            Chart(
                f"{sentence(signal)} of {first} and of the run chosen, at the same phases of the forcing or, where "
                "neither repeats, at the same times.",
                "time (ms)", f"{signal} ({shown_unit})", curves, command,
                choices=list(dict.fromkeys(str(curve.choice) for curve in curves)), choice="against",
            )
        )  # fmt: skip
    return charts
