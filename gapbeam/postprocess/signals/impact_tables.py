"""Impacts in a span of time: rates and distributions of each face, as text and data."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

QUANTITIES = {"approach speed": ("mm/s", 1.0e3), "impulse": ("mN s", 1.0e3), "duration": ("ms", 1.0e3)}
"""Unit shown and factor to it, in the order of the columns behind the time."""
PERCENTILES = (5.0, 50.0, 95.0)
HEADS = ("face", "", "mean", "5 %", "median", "95 %", "largest")


def in_span(impacts: Mapping[str, np.ndarray], begin: float, end: float) -> dict[str, np.ndarray]:
    """Return the impacts that began in a span of time, (k, 5) by face; faces without any are left out."""
    kept = {face: rows[(rows[:, 0] >= begin) & (rows[:, 0] <= end)] for face, rows in impacts.items()}
    return {face: rows for face, rows in kept.items() if len(rows)}


def rates(impacts: Mapping[str, np.ndarray], seconds: float) -> dict[str, float]:
    """Return the impacts per second at each face."""
    return {face: float(rows[:, 4].sum()) / seconds for face, rows in impacts.items()}


def distributions(rows: np.ndarray) -> dict[str, tuple[float, ...]]:
    """Return mean, percentiles and largest value of speed, impulse and duration, in the units shown."""
    found = {}
    for column, (name, (_, factor)) in enumerate(QUANTITIES.items(), start=1):
        values = factor * rows[:, column]
        found[name] = (float(values.mean()), *map(float, np.percentile(values, PERCENTILES)), float(values.max()))
    return found


def impact_rows(impacts: Mapping[str, np.ndarray], seconds: float) -> list[str]:
    """Return lines of text: the rate and the distributions of every face."""
    rows = [f"Impacts in {seconds:.4g} s", f"  {'':32}" + "".join(f"{head:>12}" for head in HEADS[2:])]
    for face, rate in rates(impacts, seconds).items():
        every = int(impacts[face][0, 4])
        rest = f", distributions from one in {every}" if every > 1 else ""
        rows.append(f"  {face}: {rate:.4g} in a second{rest}")
        for name, values in distributions(impacts[face]).items():
            label = f"{name}, {QUANTITIES[name][0]}"
            rows.append(f"    {label:30}" + "".join(f"{value:12.4g}" for value in values))
    return rows


def impact_data(impacts: Mapping[str, np.ndarray], seconds: float) -> dict[str, object]:
    """Return the rates, and the distributions in SI units, as plain data."""
    return {
        face: {"rate": rate}
        | {
            name.replace(" ", "_"): dict(zip(HEADS[2:], (value / QUANTITIES[name][1] for value in values), strict=True))
            for name, values in distributions(impacts[face]).items()
        }
        for face, rate in rates(impacts, seconds).items()
    }
