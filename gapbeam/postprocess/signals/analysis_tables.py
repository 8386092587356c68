"""The findings of an analysis as text and as plain data."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.signals.probe_analysis import Analysis, SignalAnalysis
from gapbeam.postprocess.signals.spectra import HarmonicLine, distortion


def as_text(analysis: Analysis, title: str = "") -> str:
    """Print peaks, harmonics and period as tables, in mm, mm/s and g.

    Args:
        analysis: From `gapbeam.postprocess.signals.probe_analysis.analyze`.
        title: First line.
    """
    lines = [title] if title else []
    if analysis.probe is not None:
        lines.append(f"probe {analysis.probe}, direction {analysis.component}")
    if analysis.forcing_frequency is not None:
        lines.append(f"forcing every {1e3 / analysis.forcing_frequency:g} ms, {analysis.forcing_frequency:g} Hz")
    if analysis.signals:
        lines += ["", *_peak_rows(analysis)]
    if analysis.periodicity is not None:
        lines += ["", "Periodicity", f"  {analysis.periodicity.verdict}"]
    if any(one.harmonics for one in analysis.signals.values()):
        lines += ["", *_harmonic_rows(analysis)]
    if analysis.warnings:
        lines += ["", "Warnings", *(f"  {text}" for text in analysis.warnings)]
    return "\n".join(lines).strip() + "\n"


def as_data(analysis: Analysis) -> dict[str, Any]:
    """The findings in SI units as plain numbers, lists and strings that JSON can hold (inf as null)."""
    period = analysis.periodicity
    return {
        "probe": analysis.probe,
        "component": analysis.component,
        "forcing_frequency": analysis.forcing_frequency,
        "signals": {name: _signal_data(one) for name, one in analysis.signals.items()},
        "periodicity": None
        if period is None
        else {
            "period": period.period,
            "residual": _finite(period.residual),
            "remaining": _finite(period.remaining),
            "repeats": period.repeats,
            "transient": period.transient,
            "longest": period.longest,
            "tolerance": period.tolerance,
            "verdict": period.verdict,
        },
        "warnings": list(analysis.warnings),
    }


def _peak_rows(analysis: Analysis) -> list[str]:
    rows = ["Peaks", f"  {'':24}{'minimum':>12}{'at s':>10}{'maximum':>12}{'at s':>10}{'peak to peak':>14}"]
    for name, one in analysis.signals.items():
        unit, factor = shown(one.signal.unit)
        found = one.peaks
        rows.append(
            f"  {f'{name}, {unit}':24}{factor * found.minimum:12.5g}{found.time_of_minimum:10.4f}"
            f"{factor * found.maximum:12.5g}{found.time_of_maximum:10.4f}{factor * found.peak_to_peak:14.5g}"
        )
    with_periods = [
        (name, shown(one.signal.unit)[0], one.per_period, shown(one.signal.unit)[1])
        for name, one in analysis.signals.items()
        if one.per_period is not None
    ]
    if with_periods:
        rows += ["", "Peak to peak in a forcing period, over the last half of the periods"]
        rows.append(f"  {'':24}{'median':>12}{'smallest':>12}{'largest':>12}")
    for name, unit, table, factor in with_periods:
        values = factor * table.peak_to_peak[-max(1, table.period.size // 2) :]
        rows.append(f"  {f'{name}, {unit}':24}{np.median(values):12.5g}{values.min():12.5g}{values.max():12.5g}")
    return rows


def _harmonic_rows(analysis: Analysis) -> list[str]:
    columns = {name: one for name, one in analysis.signals.items() if one.harmonics}
    heads = "".join(f"{f'{name}, {shown(one.signal.unit)[0]}':>28}" for name, one in columns.items())
    rows = ["Amplitudes of harmonics", f"  {'order':>6}{'Hz':>10}{heads}"]
    by_order = {name: {row.order: row for row in one.harmonics} for name, one in columns.items()}
    orders = sorted({order for table in by_order.values() for order in table})
    for order in orders:
        frequency = float(order) * (analysis.forcing_frequency or 0.0)
        cells = "".join(
            f"{_cell(by_order[name].get(order), shown(one.signal.unit)[1]):>28}" for name, one in columns.items()
        )
        rows.append(f"  {order!s:>6}{frequency:10.5g}{cells}")
    rest = "".join(f"{distortion(one.harmonics):28.4g}" for one in columns.values())
    rows.append(f"  {'higher harmonics/first':>16}{rest[6:]}")
    spans = ", ".join(
        f"{name} {one.spectrum.periods} periods from {one.spectrum.start:.4g} s, {one.spectrum.window}"
        for name, one in columns.items()
        if one.spectrum is not None
    )
    return [*rows, f"  spans: {spans}"]


def _cell(row: HarmonicLine | None, factor: float) -> str:
    return "-" if row is None else f"{factor * row.amplitude:.5g}"


def _signal_data(one: SignalAnalysis) -> dict[str, Any]:
    found, lines, table = one.peaks, one.spectrum, one.per_period
    return {
        "unit": one.signal.unit,
        "maximum": found.maximum,
        "minimum": found.minimum,
        "peak_to_peak": found.peak_to_peak,
        "time_of_maximum": found.time_of_maximum,
        "time_of_minimum": found.time_of_minimum,
        "per_period": None
        if table is None
        else {
            "period": table.period.tolist(),
            "maximum": table.maximum.tolist(),
            "minimum": table.minimum.tolist(),
        },
        "spectrum": None
        if lines is None
        else {
            "window": lines.window,
            "periods": lines.periods,
            "start": lines.start,
            "end": lines.end,
            "resolution": lines.resolution,
        },
        "harmonics": [
            {
                "order": str(row.order),
                "frequency": row.frequency,
                "amplitude": row.amplitude,
                "phase": row.phase,
            }
            for row in one.harmonics
        ],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
