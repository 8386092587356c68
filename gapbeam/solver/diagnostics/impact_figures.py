"""Impacts in figures: how many in a second, and how approach speed, impulse and duration are distributed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gapbeam.solver.diagnostics.impact_list import COLUMNS, ImpactList
from gapbeam.solver.diagnostics.impacts import Impacts
from gapbeam.solver.supports.layout import Layout

PERCENTILES = (5, 50, 95)
HIGHEST = "largest"


def impact_figures(impacts: Impacts, layout: Layout, seconds: float) -> dict[str, Any]:
    """Return the figures of the impacts of each support and of each of its faces, by name.

    Args:
        impacts: Of a march.
        layout: Its supports, whose faces are those of the march in this order.
        seconds: Span of the march, s.
    """
    lists, found = iter(impacts.ended), dict[str, Any]()
    for support in layout.supports:
        mine = [next(lists) for _ in support.faces]
        faces = {face.name: figures_of_lists([one], seconds) for face, one in zip(support.faces, mine, strict=True)}
        found[support.name] = figures_of_lists(mine, seconds) | {"faces": faces}
    return found


def figures_of_lists(lists: Sequence[ImpactList], seconds: float) -> dict[str, Any]:
    """Return count, rate and distributions of the impacts of some lists together, over a span of time, s."""
    count = sum(one.count for one in lists)
    every = [one.every for one in lists]
    rows = np.concatenate([np.repeat(one.rows, one.every // min(every), axis=0) for one in lists])
    found: dict[str, Any] = {"count": count, "rate": count / seconds if seconds > 0.0 else 0.0}
    found["kept_one_in"] = max(every)
    for number, name in enumerate(COLUMNS[1:], start=1):
        values = rows[:, number]
        found[name] = _distribution(values) if len(values) else None
    return found


def _distribution(values: np.ndarray) -> dict[str, float]:
    """Return mean, percentiles and largest value."""
    shares = {f"percentile_{p}": float(np.percentile(values, p)) for p in PERCENTILES}
    return {"mean": float(values.mean()), **shares, HIGHEST: float(values.max())}
