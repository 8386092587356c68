"""Opening of the report of a run: verdict, created energy, warnings, key figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gapbeam.postprocess.display_units import shown, shown_by
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    ReportSection,
    TableBlock,
    Verdict,
    Words,
    number,
    percent,
    warnings_of,
)
from gapbeam.postprocess.report.sections.support_section import (
    doubts_of_figures,
    impulsive_faces,
    support_table,
    things_to_do,
)
from gapbeam.postprocess.results.columns_of_run import supports_of
from gapbeam.postprocess.results.results import Results

_SPATIAL = 3


def assumptions_table(summary: Mapping[str, Any]) -> TableBlock | None:
    """Return the assumptions of a run, the closest to its limit first; None where the summary has none.

    Args:
        summary: `Results.summary`.
    """
    found = [one for one in summary.get("assumptions") or () if isinstance(one, Mapping)]
    if not found:
        return None
    rows: list[tuple[Cell, ...]] = [
        (
            str(one["name"]),
            str(one["quantity"]),
            _value(one["closest"], one["unit"]),
            _value(one["limit"], one["unit"]),
            None if one.get("share_of_limit") is None else 100.0 * float(one["share_of_limit"]),
            _where(one),
            str(one["verdict"]),
        )
        for one in sorted(found, key=_rank)
    ]
    heads = ("assumption", "watched", "closest", "limit", "of the limit (%)", "when and where", "verdict")
    return TableBlock(
        "Assumptions behind the figures, and how close the run came to their limits", heads, rows, digits=3
    )


def _rank(one: Mapping[str, Any]) -> float:
    share = one.get("share_of_limit")
    return -float("inf") if share is None else -float(share)


def _value(value: float | None, unit: str) -> str:
    text = "not finite" if value is None else number(float(value), 3)
    return text if unit == "1" else f"{text} {unit}"


def _where(one: Mapping[str, Any]) -> str:
    parts = [] if one.get("time") is None else [f"t = {number(float(one['time']), 4)} s"]
    place = one.get("place")
    if place:
        parts.append(f"({', '.join(number(float(x), 3) for x in place[:_SPATIAL])}) m")
    if one.get("detail"):
        parts.append(str(one["detail"]))
    return ", ".join(parts)


def errors_table(summary: Mapping[str, Any]) -> TableBlock | None:
    """Return the key figures with their errors, by part of the run; None where the summary has none.

    Args:
        summary: `Results.summary`.
    """
    errors = summary.get("errors")
    found = errors.get("figures") if isinstance(errors, Mapping) else None
    rows = [_row(one) for one in found or () if isinstance(one, Mapping)]
    if not rows or not isinstance(errors, Mapping):
        return None
    horizon = errors.get("horizon")
    until = "" if horizon is None else f"; the motion can be predicted up to t = {float(horizon):.4g} s"
    heads = ("figure", "part of the run", "value", "unit", "error", "error (%)")
    return TableBlock(f"Key figures with the estimates of their errors{until}", heads, rows, digits=3)


def _row(one: Mapping[str, Any]) -> tuple[Cell, ...]:
    relative, (unit, factor) = one.get("relative_error"), shown(str(one.get("unit")), one.get("value") or 0.0)
    return (
        str(one.get("name")),
        str(one.get("span")),
        _number(one.get("value"), factor),
        unit,
        _number(one.get("error"), factor),
        None if relative is None else 100.0 * float(relative),
    )


def _number(value: Any, factor: float) -> float | None:
    return None if value is None else factor * float(value)


MOST = 200  # contacts in the table


def scene_table(summary: Mapping[str, Any]) -> ReportSection | None:
    """Return the section on the scene of a run; None for the run of a case.

    Args:
        summary: `Results.summary`.
    """
    scene = summary.get("scene")
    if not isinstance(scene, Mapping):
        return None
    kept = "keeps the energy balance at any step" if scene.get("keeps_energy") else "promises no energy balance"
    blocks: list[Block] = [
        Words(f"Step {float(scene['step']):.6g} s up to t = {float(scene['end']):.6g} s, by a scheme that {kept}.")
    ]
    bodies = [(one["name"] or "?", one["dofs"], ", ".join(one["points"])) for one in scene.get("structures", ())]
    blocks.append(TableBlock("Structures", ("structure", "DOFs", "points"), bodies))
    contacts = scene.get("contacts") or ()
    rows: list[tuple[Cell, ...]] = [
        (
            one["name"] or "?", " and ".join(one["between"]), one["region"], _digits(one["clearance"]), one["law"],
            ", ".join(f"{name} {_digits(value)}" for name, value in one["values"].items()), _digits(one["friction"]),
        )
        for one in contacts[:MOST]
    ]  # fmt: skip
    if rows:
        heads = ("contact", "between", "region", "clearance (m)", "law", "values (SI)", "friction")
        more = f", the first {MOST} of {len(contacts)}" if len(contacts) > MOST else ""
        blocks.append(TableBlock(f"Contacts{more}", heads, rows))
    loads = [(one["name"] or "?", one["type"]) for one in scene.get("loads", ())]
    if loads:
        blocks.append(TableBlock("Loads", ("load", "kind"), loads))
    if summary.get("sources"):
        blocks.append(TableBlock("Values given by hand", ("value", "source"), [*summary["sources"].items()]))
    return ReportSection("The scene", "scene", blocks)


def _digits(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float | int) else str(value)


Row = tuple[Cell, ...]
FIGURE_HEADS = ("figure", "value", "unit")
_MICRO, _MILLI, _MEGA = 1.0e6, 1.0e3, 1.0e-6


def run_verdicts(results: Results) -> list[Verdict]:
    """Return verdicts on a run, the worst first: failure, created energy, the end, warnings.

    Raises:
        ResultsError: The summary cannot be read.
    """
    summary = results.summary
    message = str(summary.get("message") or "")
    if results.status == "completed" and summary.get("errors"):
        message = message.split("; ")[0]  # the figures behind it stand in the table of their errors
    found = [_ending(results.status, message, doubts_of_figures(summary))]
    created = created_energy(summary)
    if created is not None and results.status == "completed":
        found.insert(0, Verdict("error", created))
    return found + warnings_of([str(text) for text in summary.get("warnings") or ()])


def created_energy(summary: dict[str, Any]) -> str | None:
    """Return the warning that a run created more energy than its gates allow, though it was accepted; else None."""
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
    """Return the verdicts on a run and its key figures, then its cost.

    Args:
        results: Results of a run.
        anchor: Anchor of the section.
    """
    rows = [*result_figures(results), *cost_figures(results)]
    table = [TableBlock("Key figures of the run", FIGURE_HEADS, rows)] if rows else []
    made = (errors_table(results.summary), assumptions_table(results.summary), defaults_table(results.summary))
    blocks: list[Block] = [*run_verdicts(results), *table, *(one for one in made if one is not None)]
    return ReportSection("Summary", anchor, blocks)


def opening_section(results: Results, scene: Sequence[Block] = ()) -> ReportSection:
    """Return the opening section of a run: how it ended, loads on the supports, things to do, the moving scene.

    Args:
        results: Results of a run.
        scene: The motion.
    """
    found = run_verdicts(results)
    first = [one for one in found if one.level == "error"] or found[:1]
    table = support_table(results.summary)
    tables = [one for one in (own_table(results.summary), table) if one is not None]
    blocks: list[Block] = [*first, *tables, *things_to_do(results.summary), *scene]
    return ReportSection("Summary", "summary", blocks)


def own_table(summary: Mapping[str, Any]) -> TableBlock | None:
    """Return the figures of one's own with their errors or intervals; None where there are none."""
    errors = {one["name"]: one["error"] for one in (summary.get("errors") or {}).get("figures") or ()}
    intervals = {one["name"]: one for one in (summary.get("statistics") or {}).get("figures") or ()}
    rows: list[Row] = []
    for name, one in (summary.get("figures") or {}).items():
        error, ends = errors.get(name), one if "low" in one else intervals.get(name)
        value, high = one["value"], None if ends is None else ends["high"]
        unit, factor = shown_by(one["unit"], (value, error, high))
        words = "not known" if error is None else f"± {number(factor * error, 2)}"
        if ends is not None:
            words = f"{number(factor * ends['low'])} to {number(factor * ends['high'])} (95 %)"
        words = one["reason"] if value is None else words
        rows.append((name, None if value is None else factor * value, "" if unit == "1" else unit, words))
    return TableBlock("Figures of the case", (*FIGURE_HEADS, "error or interval"), rows) if rows else None


def figures_section(results: Results, peaks: Sequence[Row] = ()) -> ReportSection | None:
    """Return all warnings and figures of a run, folded; None where there are none.

    Args:
        results: Results of a run.
        peaks: Rows of the table of results that its history gives.
    """
    blocks: list[Block] = [*warnings_of([str(text) for text in results.summary.get("warnings") or ()])]
    if rows := [*peaks, *result_figures(results)]:
        blocks.append(TableBlock("Results of the run", FIGURE_HEADS, rows))
    errors = errors_table(results.summary)
    blocks += [errors] if errors else []
    return ReportSection("All figures and warnings", "all-figures", blocks, folded=True) if blocks else None


def limits_section(results: Results) -> ReportSection | None:
    """Return the margins of a run to its assumptions; None where the summary has none."""
    table = assumptions_table(results.summary)
    return None if table is None else ReportSection("Margins", "limits", [table])


def computation_section(results: Results) -> ReportSection | None:
    """Return the section on cost, steps and defaults of a run; None where the summary has none of them."""
    rows = cost_figures(results)
    tables = [TableBlock("Steps, time and memory", FIGURE_HEADS, rows)] if rows else []
    defaults = defaults_table(results.summary)
    blocks: list[Block] = [*tables, *([defaults] if defaults else [])]
    return ReportSection("Computation", "computation", blocks) if blocks else None


def defaults_table(summary: Mapping[str, Any]) -> TableBlock | None:
    """Return the computed defaults of a run with their reasons; None where there are none."""
    defaults = summary.get("defaults") or ()
    if not defaults:
        return None
    return TableBlock(
        "Values that decide how accurate the run is, and where they come from",
        ("key", "value", "unit", "reason"),
        [(one["key"], float(one["value"]), one["unit"], one["reason"]) for one in defaults],
    )


def result_figures(results: Results) -> list[Row]:
    """Return name, value and unit of the results that the summary reports, as far as they are there."""
    summary = results.summary
    supports = supports_of(summary, results.case) if results.case.get("support") else ()
    alone, impacts = len(supports) == 1, summary.get("impacts") or {}
    rows: list[Row] = [
        *(
            _sized(f"largest contact force of a step on the {face}", float(force), "N")
            for face, force in (summary.get("peak_contact_force") or {}).items()
        ),
        *(
            _sized(
                f"largest impulse of an impact on the {face}", _of(impacts.get(face) or {}, "impulse", "largest"), "N s"
            )
            for face in impulsive_faces(summary)
        ),
        _sized("largest penetration", _of(summary, "penetration", "largest"), "m"),
        ("largest penetration over the clearance", _of(summary, "penetration", "relative_to_clearance", 100.0), "%"),
        _sized("energy exchanged", _of(summary, "energy", "exchanged"), "J"),
        ("impacts", _of(summary, "gates", "impacts"), ""),
        *(_sized("clearance" if alone else f"clearance of {one.name}", one.clearance, "m") for one in supports),
        ("forcing frequency", results.forcing_frequency, "Hz"),
    ]
    return [row for row in rows if row[1] is not None]


def _sized(words: str, value: float | None, unit: str) -> Row:
    """Return name, value and unit of a figure in the unit in which it is read best; nothing where it is not known."""
    unit, factor = shown(unit, value or 0.0)
    return words, None if value is None else factor * value, unit


def cost_figures(results: Results) -> list[Row]:
    """Return name, value and unit of steps, energy errors, time and memory of a run, as far as they are there."""
    summary = results.summary
    memory = (summary.get("memory") or {}).get("peak_per_rank")
    rows: list[Row] = [
        ("unknowns", _of(summary, "model", "dofs"), ""),
        ("steps", _of(summary, "convergence", "steps"), ""),
        _sized("energy created by the scheme", _of(summary, "energy", "created"), "J"),
        ("residual of the energy balance over the energy exchanged", _of(summary, "energy", "relative_residual"), ""),
        ("impacts outside the gates", _of(summary, "gates", "violations"), ""),
        ("contact iterations of a step, mean", _of(summary, "convergence", "iterations_mean"), ""),
        ("wall time", _of(summary, "wall_time", "total"), "s"),
        ("wall time of a step", _of(summary, "wall_time", "per_step", _MICRO), "µs"),
        ("memory, all ranks", None if not memory else _MEGA * float(sum(memory)), "MB"),
    ]
    return [row for row in rows if row[1] is not None]


def _of(summary: Mapping[str, Any], table: str, key: str, factor: float = 1.0) -> float | int | None:
    value = (summary.get(table) or {}).get(key)
    if value is None or isinstance(value, str):
        return None
    return value if isinstance(value, int) else factor * float(value)


def _ending(status: str, message: str, doubts: Sequence[str]) -> Verdict:
    message = message.replace("+-", "±")
    words = f" {message}" if message else ""
    if status == "completed" and doubts:
        return Verdict("warning", f"**The run completed, and not every figure may be used**: {'; '.join(doubts)}.")
    if status == "completed":
        return Verdict("passed", f"The run completed: {message}" if message else "The run completed.")
    if status == "running":
        return Verdict("warning", f"The run is still going on, or was killed: the records end where it was.{words}")
    if status == "unknown":
        return Verdict("warning", "There is no `summary.json`: how the run ended is not known.")
    return Verdict("error", f"**The run {'was ' if status == 'interrupted' else ''}{status}.**{words}")
