"""Tables of a report: limits of the assumptions, key figures with their error estimates, and a scene from Python."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Words, number

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
    relative, (unit, factor) = one.get("relative_error"), shown(str(one.get("unit")))
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
