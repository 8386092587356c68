"""Motion of the probes: histories, peaks in every forcing period, phase portrait, periodicity, and spectra."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gapbeam.postprocess.display_units import shown, size_words
from gapbeam.postprocess.report.blocks import Block, Cell, Level, ReportSection, TableBlock, Verdict
from gapbeam.postprocess.report.charts import MOST, Chart, ChartCurve, envelope, thinning_words
from gapbeam.postprocess.report.sections.support_section import ZOOM, end_words, is_long
from gapbeam.postprocess.signals.probe_analysis import Analysis, SignalAnalysis
from gapbeam.postprocess.signals.signal import Signal, enlarged_span, unit_of_record, unit_of_time
from gapbeam.postprocess.signals.spectra import distortion
from gapbeam.solver.messages.wording import counted

PORTRAIT = 6000  # points
FEWEST = 3  # forcing periods worth a figure over them
_RECORDED = "as recorded"


def motion_section(analyses: Mapping[str, Analysis], command: str, repeats: bool = False) -> ReportSection:
    """Return histories and peaks of every probe, one button each.

    Args:
        analyses: Analyses by probe, each with a displacement.
        command: Command that makes the figures.
        repeats: Whether the records are a period over and over, of which the last forcing periods show everything.
    """
    blocks: list[Block] = []
    spans = (True,) if repeats else (False, True) if _is_long(analyses) else (False,)
    for name in ("displacement", "acceleration"):
        blocks += [chart for last in spans if (chart := _history(analyses, name, last, command)) is not None]
    blocks.append(_peaks_table(analyses))
    per_period = [] if repeats else _per_period(analyses, command)
    return ReportSection("Motion", "motion", [*blocks, *per_period])


def periodicity_section(analyses: Mapping[str, Analysis], command: str) -> ReportSection | None:
    """Return the phase portrait with its Poincaré points and their interpretation; None without a forcing period."""
    blocks: list[Block] = []
    for probe, one in analyses.items():
        if one.periodicity is not None:
            level: Level = "passed" if one.periodicity.period is not None else "warning"
            blocks.append(Verdict(level, f"{probe}: {one.periodicity.verdict}"))
    unit, length = _display(analyses, "displacement")
    speed_unit, speed = _display(analyses, "velocity")
    portrait = [curve for probe, one in analyses.items() for curve in _portrait(probe, one, length, speed)]
    strobe = [curve for probe, one in analyses.items() for curve in _strobe(probe, one, length)]
    probes = [probe for probe in analyses if any(curve.choice == probe for curve in portrait)]
    if not portrait:
        return None
    blocks.append(
        Chart(
            "Velocity over displacement, of the settled response or the last twelve forcing periods; once in every "
            "forcing period a point.",
            f"displacement ({unit})", f"velocity ({speed_unit})", portrait, command,
            choices=probes, choice="probe",
        )
    )  # fmt: skip
    if strobe:
        blocks.append(
            Chart(
                "Displacement at the start of every forcing period: as many heights as the cycle has forcing periods.",
                "forcing period", f"displacement ({unit})", strobe, command, choices=probes, choice="probe",
            )
        )  # fmt: skip
    return ReportSection("Periodicity", "periodicity", blocks)


def _is_long(analyses: Mapping[str, Analysis]) -> bool:
    one = next(iter(analyses.values()))
    assert one.displacement is not None
    return is_long(one.displacement.signal.time, one.forcing_frequency)


def _history(analyses: Mapping[str, Analysis], name: str, last: bool, command: str) -> Chart | None:
    """Return a signal of every probe over the whole record, or over its last forcing periods."""
    curves, size = [], 0
    unit, factor = _display(analyses, name)
    clock, in_clock = _clock(analyses, last)
    for probe, analysis in analyses.items():
        one = analysis.signals.get(name)
        if one is None:
            continue
        smoothed = analysis.smoothed if name == "acceleration" else None
        span = enlarged_span(one.signal.time, one.signal.values, analysis.forcing_frequency, ZOOM)
        pairs = [(_RECORDED if smoothed else name, one)]
        pairs += [(f"moving average over {size_words(smoothed.signal.width, 3, 's')}", smoothed)] if smoothed else []
        for label, part in pairs:
            signal = part.signal.between(*span) if last else part.signal
            size = max(size, signal.time.size)
            curves.append(_curve(label, signal, probe, in_clock, factor))
    if not curves:
        return None
    frequency = next(iter(analyses.values())).forcing_frequency
    frame = "relative to the support" if name == "displacement" else "in the inertial frame"
    return Chart(
        f"{name.capitalize()} {frame}, {end_words(frequency) if last else 'the whole record'}.{thinning_words(size)}",
        f"time ({clock})",
        f"{name} ({unit})",
        curves,
        command,
        choices=list(dict.fromkeys(str(curve.choice) for curve in curves)),
        choice="probe",
    )


def _clock(analyses: Mapping[str, Analysis], last: bool) -> tuple[str, float]:
    """Return the unit of the times of records, or of their last forcing periods, and the factor to it."""
    one = next(iter(analyses.values())).displacement
    assert one is not None
    time = one.signal.time
    return unit_of_time((time[0], time[-1])) if last else unit_of_record(time)


def _display(analyses: Mapping[str, Analysis], name: str) -> tuple[str, float]:
    """Return the unit in which a signal of all probes is shown, by the largest of them, and the factor to it."""
    found = [one for analysis in analyses.values() if (one := analysis.signals.get(name)) is not None]
    largest = max(found, key=lambda one: max(abs(one.peaks.minimum), abs(one.peaks.maximum)), default=None)
    return shown("m") if largest is None else largest.display


def _curve(label: str, signal: Signal, probe: str, scale: float, factor: float) -> ChartCurve:
    time, values = envelope(scale * signal.time, factor * signal.values, MOST)
    return ChartCurve(label, time, values, choice=probe)


def _peaks_table(analyses: Mapping[str, Analysis]) -> TableBlock:
    rows = []
    for probe, analysis in analyses.items():
        for name, one in analysis.signals.items():
            unit, factor = one.display
            found = one.peaks
            rows.append(
                (
                    probe, f"{name} ({unit})", factor * found.minimum, found.time_of_minimum, factor * found.maximum,
                    found.time_of_maximum, factor * found.peak_to_peak, _median(one, factor),
                )
            )  # fmt: skip
    return TableBlock(
        "Peaks of the whole record, and of a forcing period",
        ("probe", "signal", "smallest", "at (s)", "largest", "at (s)", "peak to peak", "in a forcing period"),
        rows,
        notes=("In a forcing period: the median of the last half of the periods.",),
    )


def _median(one: SignalAnalysis, factor: float) -> float | None:
    if one.per_period is None:
        return None
    values = one.per_period.peak_to_peak
    return factor * float(np.median(values[-max(1, values.size // 2) :]))


def _per_period(analyses: Mapping[str, Analysis], command: str) -> list[Chart]:
    """Return the extremes of the smoothed acceleration, or the displacement, in every forcing period."""
    charts = []
    for name in ("displacement", "smoothed acceleration"):
        curves = []
        unit, factor = _display(analyses, name)
        for probe, analysis in analyses.items():
            one = analysis.signals.get(name)
            if one is None or one.per_period is None or one.per_period.period.size < FEWEST:
                continue
            table = one.per_period
            for label, values in (("largest", table.maximum), ("smallest", table.minimum)):
                curves.append(ChartCurve(label, table.period, factor * values, "lines+markers", probe))
        if curves:
            charts.append(
                Chart(
                    f"Largest and smallest {name} in every forcing period.",
                    "forcing period", f"{name} ({unit})", curves, command,
                    choices=list(dict.fromkeys(str(curve.choice) for curve in curves)), choice="probe",
                )
            )  # fmt: skip
    return charts


def _portrait(probe: str, analysis: Analysis, length: float, speed: float) -> list[ChartCurve]:
    if analysis.section is None or analysis.displacement is None or analysis.velocity is None:
        return []
    displacement, velocity = analysis.displacement.signal, analysis.velocity.signal
    first = int(np.searchsorted(displacement.time, analysis.settled_since()))
    every = max(1, -(-(displacement.time.size - first) // PORTRAIT))
    part, seen = slice(first, None, every), analysis.settled_states()
    points = length * analysis.section.displacement[seen], speed * analysis.section.velocity[seen]
    return [
        ChartCurve(
            "motion",
            length * displacement.values[part],
            speed * velocity.values[part],
            choice=probe,
            times=displacement.time[part],
        ),
        ChartCurve("once in a forcing period", *points, mode="markers", choice=probe),
    ]


def _strobe(probe: str, analysis: Analysis, length: float) -> list[ChartCurve]:
    if analysis.section is None or analysis.forcing_frequency is None or analysis.displacement is None:
        return []
    if analysis.section.time.size < FEWEST:
        return []
    number = np.round(analysis.section.time * analysis.forcing_frequency)
    heights = length * analysis.section.displacement
    return [ChartCurve("displacement", number, heights, "markers", probe)]


HIGHEST = 10.5  # harmonics of the forcing that are drawn
DECADES = 5.0
_LINES = {"displacement": "spectrum", "acceleration": "as recorded", "smoothed acceleration": "moving average"}


def spectra_section(analyses: Mapping[str, Analysis], command: str) -> ReportSection | None:
    """Return spectra and tables of harmonics of every probe; None where no record is long enough for a spectrum.

    Args:
        analyses: Analyses by probe.
        command: Command that makes the figures.
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
    return ReportSection("Spectra", "spectra", blocks) if blocks else None


def _chart(analyses: Mapping[str, Analysis], names: tuple[str, ...], command: str) -> Chart | None:
    curves, heights, span = [], list[np.ndarray](), ""
    unit, factor = _display(analyses, names[0])
    for probe, analysis in analyses.items():
        for name in names:
            one = analysis.signals.get(name)
            if one is None or one.spectrum is None:
                continue
            span = _span(one)
            found = _curves(one, _LINES[name], probe, analysis.forcing_frequency, (unit, factor))
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
        f"amplitude ({unit})",
        curves,
        command,
        log_y=True,
        y_range=(0.5 * foot, 2.5 * top),
        choices=list(dict.fromkeys(str(curve.choice) for curve in curves)),
        choice="probe",
    )


def _curves(
    one: SignalAnalysis, label: str, probe: str, frequency: float | None, display: tuple[str, float]
) -> list[ChartCurve]:
    lines = one.spectrum
    assert lines is not None
    unit, factor = display
    limit = np.inf if frequency is None else HIGHEST * frequency
    band = (lines.frequency > 0.0) & (lines.frequency <= limit)
    drawn = envelope(lines.frequency[band], np.maximum(factor * lines.amplitude[band], 1e-300))
    curves = [ChartCurve(label, *drawn, choice=probe)]
    if one.harmonics:
        heights = [factor * row.amplitude for row in one.harmonics]
        texts = [
            f"order {row.order}, {row.frequency:.6g} Hz: {height:.4g} {unit}"
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
    return f" over {counted(lines.periods, 'forcing period')} from {lines.start:.4g} s, {lines.window} window"


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
            cells.append(None if amplitude is None else one.display[1] * amplitude)
        rows.append((str(order), float(order) * analysis.forcing_frequency, *cells))
    rest = ", ".join(f"{name} {distortion(one.harmonics):.4g}" for name, one in columns.items())
    heads = (f"{name} ({one.display[0]})" for name, one in columns.items())
    return TableBlock(
        f"Amplitudes of the harmonics at the probe {probe}",
        ("order", "frequency (Hz)", *heads),
        rows,
        notes=(f"Higher harmonics over the first, root of the sum of squares: {rest}.",),
    )
