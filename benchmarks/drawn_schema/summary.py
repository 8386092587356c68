"""The lines of a report counted by choice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from benchmarks.table import Cell, Table

COLUMNS = ("choice", "drawn", "status 0", "compared", "refused (2)", "3, 4, 124", "findings")
NOT_TRUSTED = (3, 4, 124)  # energy created or lost, not converged or an assumption broken, out of time


def table_of(lines: Sequence[dict[str, Any]]) -> Table:
    """Return the table: for each value of each choice how many cases were drawn, and how they ended."""
    kinds: dict[str, list[dict[str, Any]]] = {"all": list(lines)}
    for line in lines:
        for key, value in (*line["choices"].items(), ("way", line["way"])):
            if key != "loads":
                kinds.setdefault(f"{key}: {value}", []).append(line)
        for load in line["choices"]["loads"].split("+"):
            kinds.setdefault(f"load: {load}", []).append(line)
    order = sorted(kinds, key=lambda name: (name != "all", name))
    figures = sum(line.get("figures") or 0 for line in lines)
    above = sum(line.get("above") or 0 for line in lines)
    findings = sum(bool(line["findings"]) for line in lines)
    return Table(
        "drawn",
        "Cases drawn from the whole schema",
        COLUMNS,
        tuple(_row(name, kinds[name]) for name in order),
        (f"{figures} figures or motions compared, {above} outside of what is allowed",),
        {"cases": len(lines), "findings": findings, "figures": figures, "above": above},
    )


def _row(name: str, lines: Sequence[dict[str, Any]]) -> tuple[Cell, ...]:
    passed, refused = (sum(line["status"] == status for line in lines) for status in (0, 2))
    stopped = sum(line["status"] in NOT_TRUSTED for line in lines)
    compared = sum(bool(line.get("figures")) for line in lines)
    findings = sum(bool(line["findings"]) for line in lines)
    return (name, len(lines), passed, compared, refused, stopped, findings)
