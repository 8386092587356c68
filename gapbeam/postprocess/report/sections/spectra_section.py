"""Amplitudes over frequency of the motion of the probes, with the harmonics of the forcing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.envelope import envelope
from gapbeam.postprocess.signals.harmonics import distortion
from gapbeam.postprocess.signals.probe_analysis import Analysis, SignalAnalysis

HIGHEST = 10.5  # harmonics of the forcing that are drawn
DECADES = 5.0
_LINES = {"displacement": "spectrum", "acceleration": "as recorded", "smoothed acceleration": "moving average"}


def spectra_section(analyses: Mapping[str, Analysis], command: str, anchor: str = "spectra") -> ReportSection | None:
    """Return spectra and tables of harmonics of every probe; None where no record is long enough for a spectrum.

    Args:
        analyses: By probe.
        command: That makes the figures.
        anchor: Of the section.
    """
    blocks: list[Block] = []
    for names in (("displacement",), ("acceleration", "smoothed acceleration")):
        chart = _chart(analyses, names, command)
        if chart is not None:
            blocks.append(chart)
    for probe, analysis in analyses.items():
        table = _harmonics(probe, analysis)
        if table is not None:
            blocks.append(table)
    return ReportSection("Spectra", anchor, blocks) if blocks else None


def _chart(analyses: Mapping[str, Analysis], names: tuple[str, ...], command: str) -> Chart | None:
    curves, heights, unit, span = [], list[np.ndarray](), "", ""
    for probe, analysis in analyses.items():
        for name in names:
            one = analysis.signals.get(name)
            if one is None or one.spectrum is None:
                continue
            unit, span = one.signal.unit, _span(one)
            found = _curves(one, _LINES[name], probe, analysis.forcing_frequency)
            curves += found
            heights.append(np.concatenate([np.asarray(curve.y) for curve in found]))
    drawn = np.concatenate(heights) if heights else np.zeros(1)
    top = float(drawn.max())
    if top <= 0.0:
        return None
    foot = max(float(drawn[drawn > 0.0].min()), top * 10.0**-DECADES)
    return Chart(
        f"Amplitudes of the {names[0]}{span}.",
        "frequency (Hz)",
        f"amplitude ({shown(unit)[0]})",
        curves,
        command,
        log_y=True,
        y_range=(0.5 * foot, 2.5 * top),
        choices=list(dict.fromkeys(str(curve.choice) for curve in curves)),
        choice="probe",
    )


def _curves(one: SignalAnalysis, label: str, probe: str, frequency: float | None) -> list[ChartCurve]:
    lines = one.spectrum
    assert lines is not None
    factor = shown(one.signal.unit)[1]
    limit = np.inf if frequency is None else HIGHEST * frequency
    band = (lines.frequency > 0.0) & (lines.frequency <= limit)
    drawn = envelope(lines.frequency[band], np.maximum(factor * lines.amplitude[band], 1e-300))
    curves = [ChartCurve(label, *drawn, choice=probe)]
    if one.harmonics:
        heights = [factor * row.amplitude for row in one.harmonics]
        texts = [
            f"order {row.order}, {row.frequency:.6g} Hz: {height:.4g} {shown(one.signal.unit)[0]}"
            for row, height in zip(one.harmonics, heights, strict=True)
        ]
        places = [row.frequency for row in one.harmonics]
        curves.append(ChartCurve(f"{label}, harmonics", places, heights, "markers", probe, texts=texts, like=label))
    return curves


def _span(one: SignalAnalysis) -> str:
    lines = one.spectrum
    assert lines is not None
    if lines.periods is None:
        return f", {lines.window} window over the whole record"
    return f" over {lines.periods} forcing periods from {lines.start:.4g} s, {lines.window} window"


def _harmonics(probe: str, analysis: Analysis) -> TableBlock | None:
    columns = {name: one for name, one in analysis.signals.items() if one.harmonics}
    if not columns or analysis.forcing_frequency is None:
        return None
    by_order = {name: {row.order: row.amplitude for row in one.harmonics} for name, one in columns.items()}
    rows: list[tuple[Cell, ...]] = []
    for order in sorted({order for found in by_order.values() for order in found}):
        cells: list[Cell] = []
        for name, one in columns.items():
            amplitude = by_order[name].get(order)
            cells.append(None if amplitude is None else shown(one.signal.unit)[1] * amplitude)
        rows.append((str(order), float(order) * analysis.forcing_frequency, *cells))
    rest = ", ".join(f"{name} {distortion(one.harmonics):.4g}" for name, one in columns.items())
    heads = (f"{name} ({shown(one.signal.unit)[0]})" for name, one in columns.items())
    return TableBlock(
        f"Amplitudes of the harmonics at the probe {probe}",
        ("order", "frequency (Hz)", *heads),
        rows,
        notes=(f"Higher harmonics over the first, root of the sum of squares: {rest}.",),
    )
