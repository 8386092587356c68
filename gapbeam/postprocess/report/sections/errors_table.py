"""The key figures of a run with the estimates of their errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Cell, TableBlock


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
