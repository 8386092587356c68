"""The scene of a run from Python: structures, contacts, loads and step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Words

MOST = 200  # contacts in the table


def scene_table(summary: Mapping[str, Any], anchor: str = "scene") -> ReportSection | None:
    """Return the section on the scene of a run; None for the run of a case.

    Args:
        summary: `Results.summary`.
        anchor: Of the section.
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
            one["name"] or "?", " and ".join(one["between"]), one["region"], _number(one["clearance"]), one["law"],
            ", ".join(f"{name} {_number(value)}" for name, value in one["values"].items()), _number(one["friction"]),
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
    return ReportSection("The scene", anchor, blocks)


def _number(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float | int) else str(value)
