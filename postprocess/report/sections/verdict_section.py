"""What a reader of a run has to know first: how it ended, created energy, warnings, figures."""

from __future__ import annotations

from typing import Any

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Verdict, warnings_of
from gapbeam.postprocess.report.number_text import number, percent
from gapbeam.postprocess.report.sections.assumptions_table import assumptions_table
from gapbeam.postprocess.report.sections.errors_table import errors_table
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results.supports_of_run import supports_of

_MICRO, _MILLI, _MEGA = 1.0e6, 1.0e3, 1.0e-6


def run_verdicts(results: Results) -> list[Verdict]:
    """Return verdicts on a run, the worst first: failure, created energy, the end, warnings.

    Raises:
        ResultsError: The summary cannot be read.
    """
    summary = results.summary
    message = str(summary.get("message") or "")
    found = [_ending(results.status, message)]
    created = created_energy(summary)
    if created is not None and results.status == "completed":
        found.insert(0, Verdict("error", created))
    return found + warnings_of([str(text) for text in summary.get("warnings") or ()])


def created_energy(summary: dict[str, Any]) -> str | None:
    """Return that a run created more energy than its gates allow, though it was accepted; None where it did not."""
    energy, limits = summary.get("energy") or {}, (summary.get("gates") or {}).get("limits") or {}
    growth, allowed = energy.get("relative_growth"), limits.get("impact_growth")
    if growth is None or allowed is None or growth <= allowed:
        return None
    return (
        f"**The scheme created {number(float(energy['created']), 3)} J, {percent(growth, signed=False)} of the energy "
        f"exchanged** (the gates allow {percent(allowed, signed=False)}; `gates.accept_energy_growth` let it pass): "
        "figures of this run are not to be trusted."
    )


def summary_section(results: Results, anchor: str = "summary") -> ReportSection:
    """Return the verdicts on a run and its key figures.

    Args:
        results: Of a run.
        anchor: Of the section.
    """
    blocks: list[Block] = [*run_verdicts(results)]
    rows = key_figures(results)
    if rows:
        blocks.append(TableBlock("Key figures of the run", ("figure", "value", "unit"), rows))
    blocks += [table for made in (errors_table, assumptions_table) if (table := made(results.summary)) is not None]
    defaults = results.summary.get("defaults") or ()
    if defaults:
        blocks.append(
            TableBlock(
                "Values that decide how accurate the run is, and where they come from",
                ("key", "value", "unit", "reason"),
                [(one["key"], float(one["value"]), one["unit"], one["reason"]) for one in defaults],
            )
        )
    return ReportSection("Summary", anchor, blocks)


def key_figures(results: Results) -> list[tuple[Cell, ...]]:
    """Return name, value and unit of what the summary reports, as far as it is there."""
    summary = results.summary

    def of(table: str, key: str, factor: float = 1.0) -> float | int | None:
        value = (summary.get(table) or {}).get(key)
        if value is None or isinstance(value, str):
            return None
        return value if isinstance(value, int) else factor * float(value)

    supports = supports_of(summary, results.case) if results.case.get("support") else ()
    alone = len(supports) == 1
    memory = (summary.get("memory") or {}).get("peak_per_rank")
    rows: list[tuple[Cell, ...]] = [
        *(("clearance" if alone else f"clearance of {one.name}", _MILLI * one.clearance, "mm") for one in supports),
        ("forcing frequency", results.forcing_frequency, "Hz"),
        ("unknowns", of("model", "dofs"), ""),
        ("steps", of("convergence", "steps"), ""),
        *(
            (f"largest contact force on the {face}", float(force), "N")
            for face, force in (summary.get("peak_contact_force") or {}).items()
        ),
        ("largest penetration", of("penetration", "largest", _MICRO), "µm"),
        ("largest penetration over the clearance", of("penetration", "relative_to_clearance", 100.0), "%"),
        ("energy exchanged", of("energy", "exchanged", _MILLI), "mJ"),
        ("energy created by the scheme", of("energy", "created", _MILLI), "mJ"),
        ("residual of the energy balance over the energy exchanged", of("energy", "relative_residual"), ""),
        ("impacts", of("gates", "impacts"), ""),
        ("impacts outside the gates", of("gates", "violations"), ""),
        ("contact iterations of a step, mean", of("convergence", "iterations_mean"), ""),
        ("wall time", of("wall_time", "total"), "s"),
        ("wall time of a step", of("wall_time", "per_step", _MICRO), "µs"),
        ("memory, all ranks", None if not memory else _MEGA * float(sum(memory)), "MB"),
    ]
    return [row for row in rows if row[1] is not None]


def _ending(status: str, message: str) -> Verdict:
    words = f" {message}" if message else ""
    if status == "completed":
        return Verdict("passed", f"The run completed: {message}" if message else "The run completed.")
    if status == "running":
        return Verdict("warning", f"The run is still going on, or was killed: the records end where it was.{words}")
    if status == "unknown":
        return Verdict("warning", "There is no `summary.json`: how the run ended is not known.")
    return Verdict("error", f"**The run {'was ' if status == 'interrupted' else ''}{status}.**{words}")
