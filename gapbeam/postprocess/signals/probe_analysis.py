"""Analysis of the history of one probe: peaks, spectra, harmonics and period, with the findings as text and as data."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from gapbeam.postprocess.display_units import finite_or_none, shown
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.signals.periodicity import (
    TOLERANCE,
    Periodicity,
    PoincareSection,
    periodicity,
    poincare_section,
)
from gapbeam.postprocess.signals.signal import (
    PeriodPeaks,
    Signal,
    SignalError,
    SignalPeaks,
    SignalWarning,
    component_name,
    peaks,
    peaks_per_period,
    probe_name,
    probe_signal,
    smooth_motions,
)
from gapbeam.postprocess.signals.spectra import (
    POINTS,
    HarmonicLine,
    Sampling,
    Spectrum,
    Window,
    default_periods,
    distortion,
    harmonics,
    smooth,
    smooth_over,
    spectrum,
    window_of,
)

if TYPE_CHECKING:
    import xarray as xr

Acceleration = Literal["absolute", "relative"]
PERIODS = 12  # of the forcing, which show a response
SLACK = 1.0e-6  # of a forcing period, by which round-off moves a time


@dataclass(frozen=True)
class Options:
    """Options for picking, smoothing and transforming signals.

    Attributes:
        probe: Name of the probe; None the first.
        component: "x", "y" or "z"; None the bending direction.
        acceleration: Acceleration in the inertial frame or relative to the support.
        rate: Sampling rate in Hz of the smoothed acceleration; None: that at which its points span `smoothing_window`.
        points: Points of its moving average.
        sampling: "mean" over the sampling interval, or "pick" at its end.
        periods: Forcing periods in the spectra; None the most of 12, 24, ... after the transient.
        window: None: rectangular over whole periods, hann without forcing.
        harmonics: Highest harmonic in the table.
        tolerance: Tolerance of the periodicity, as a fraction of the range.
    """

    probe: str | None = None
    component: str | None = None
    acceleration: Acceleration = "absolute"
    rate: float | None = None
    points: int = POINTS
    sampling: Sampling = "mean"
    periods: int | None = None
    window: Window | None = None
    harmonics: int = 10
    tolerance: float = TOLERANCE


@dataclass(frozen=True)
class SignalAnalysis:
    """One signal with its figures; None where the record or the forcing does not allow one."""

    signal: Signal
    peaks: SignalPeaks
    per_period: PeriodPeaks | None
    spectrum: Spectrum | None
    harmonics: tuple[HarmonicLine, ...]

    @property
    def display(self) -> tuple[str, float]:
        """The unit in which the signal is shown, by its largest value, and the factor to it."""
        return shown(self.signal.unit, max(abs(self.peaks.minimum), abs(self.peaks.maximum)))


@dataclass(frozen=True)
class Analysis:
    """Analysis of the history of one probe.

    Attributes:
        probe: Name of the probe; None for a run without.
        component: Direction of the motion; None without probe.
        forcing_frequency: Hz; None without a forcing period.
        displacement: Relative to the support.
        velocity: Relative to the support.
        acceleration: As recorded: means over the history interval.
        smoothed: The acceleration after the moving average.
        periodicity: Periodicity from displacement and velocity.
        section: Their Poincaré section.
        warnings: Warnings, every text once.
    """

    probe: str | None
    component: str | None
    forcing_frequency: float | None
    displacement: SignalAnalysis | None = None
    velocity: SignalAnalysis | None = None
    acceleration: SignalAnalysis | None = None
    smoothed: SignalAnalysis | None = None
    periodicity: Periodicity | None = None
    section: PoincareSection | None = None
    warnings: tuple[str, ...] = field(default=())

    def settled_states(self) -> NDArray[np.bool_]:
        """Return the mask of the states of the Poincaré section that belong to that part."""
        assert self.section is not None
        assert self.forcing_frequency is not None
        return np.asarray(self.section.time >= self.settled_since() - SLACK / self.forcing_frequency)

    def settled_since(self) -> float:
        """Return the start of the part that shows the response itself: its cycles, or its last forcing periods.

        Returns:
            Time in s; the start of the record where it has no Poincaré section.
        """
        assert self.displacement is not None
        time = self.displacement.signal.time
        start = float(time[0])
        if self.section is None or self.forcing_frequency is None:
            return start
        start = max(start, float(time[-1]) - PERIODS / self.forcing_frequency)
        settled = self.periodicity.transient if self.periodicity is not None else None
        return start if settled is None else max(start, settled)

    @property
    def signals(self) -> dict[str, SignalAnalysis]:
        """The signals that could be analyzed, by name."""
        found = {
            "displacement": self.displacement,
            "velocity": self.velocity,
            "acceleration": self.acceleration,
            "smoothed acceleration": self.smoothed,
        }
        return {name: one for name, one in found.items() if one is not None}


def analyze(results: Results, options: Options | None = None, history: xr.Dataset | None = None) -> Analysis:
    """Compute peaks, spectra, harmonics and period of the motion of a probe.

    What a short record, or one without forcing or probes, cannot give is left out, and a warning says so.

    Args:
        results: Results of a run, finished or not.
        options: See `Options`.
        history: Records to take in place of the results, such as a period that is repeated.

    Raises:
        ResultsError: The results cannot be read.
        SignalError: A probe or component that does not exist, or values that are not finite.
    """
    options = options or Options()
    frequency, history = results.forcing_frequency, results.history if history is None else history
    if options.probe is None and history.sizes.get("probe", 0) == 0:
        return Analysis(None, None, frequency, warnings=("the run recorded no probe: no motion to analyze",))
    probe, component = probe_name(history, options.probe), component_name(history, options.component)
    displacement = probe_signal(history, "displacement", probe, component)
    velocity = probe_signal(history, "velocity", probe, component)
    notes: list[str] = []
    if frequency is None:
        notes.append("the forcing has no period: no harmonics, no Poincaré section")
    if displacement.time.size < 2:
        notes.append("one record only: no motion to analyze")
        return Analysis(probe, component, frequency, warnings=tuple(notes))
    quantity = f"acceleration_{options.acceleration}"
    if quantity not in history and "acceleration_relative" in history:
        quantity = "acceleration_relative"
        notes.append("accelerations are relative to the frame: nothing says how all points move with it")
    acceleration = probe_signal(history, quantity, probe, component)
    found, section = None, None
    if frequency is not None:
        try:
            found = periodicity(smooth_motions(history, probe, component), frequency, options.tolerance)
            section = poincare_section(displacement, velocity, frequency)
        except SignalError as fault:
            notes.append(str(fault))
    if found is not None and found.transient is not None:
        steady = found.transient
    else:
        if found is not None:
            notes.append("no settled cycle: the amplitudes of the harmonics depend on the span")
        steady = float(displacement.time[0] + 0.5 * np.ptp(displacement.time))
    smoothed: Signal | None = None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SignalWarning)
        try:
            smoothed = _smoothed(acceleration, window_of(history, frequency), options)
        except SignalError as fault:
            notes.append(f"not smoothed: {fault}")
        signals = (displacement, velocity, acceleration, smoothed)
        options = replace(options, periods=options.periods or _common_periods(signals, frequency, steady))
        parts = [None if signal is None else _analyzed(signal, frequency, steady, options, notes) for signal in signals]
    notes += [str(one.message) for one in caught if issubclass(one.category, SignalWarning)]
    return Analysis(
        probe,
        component,
        frequency,
        parts[0],
        parts[1],
        parts[2],
        parts[3],
        found,
        section,
        tuple(dict.fromkeys(notes)),
    )


def _smoothed(acceleration: Signal, window: float, options: Options) -> Signal:
    """Return the moving average of an acceleration, as asked for, else over a window, s."""
    if options.rate is None and (options.points, options.sampling) == (POINTS, "mean"):
        return smooth_over(acceleration, window)
    rate = options.points / window if options.rate is None else options.rate
    return smooth(acceleration, rate, options.points, options.sampling)


def _common_periods(signals: tuple[Signal | None, ...], frequency: float | None, steady: float) -> int | None:
    """One number of periods for all spectra, so that they can be compared; None where one has none."""
    if frequency is None:
        return None
    try:
        return min(default_periods(signal, frequency, steady) for signal in signals if signal is not None) or None
    except SignalError:
        return None


def _analyzed(
    signal: Signal, frequency: float | None, steady: float, options: Options, notes: list[str]
) -> SignalAnalysis:
    per_period: PeriodPeaks | None = None
    lines: Spectrum | None = None
    table: tuple[HarmonicLine, ...] = ()
    if frequency is not None:
        try:
            per_period = peaks_per_period(signal, frequency)
        except SignalError as fault:
            notes.append(f"no peaks per period: {fault}")
    try:
        lines = spectrum(signal, frequency, options.periods, options.window, steady)
        if frequency is not None:
            table = harmonics(lines, options.harmonics)
    except SignalError as fault:
        notes.append(f"no spectrum: {fault}")
    return SignalAnalysis(signal, peaks(signal), per_period, lines, table)


def as_text(analysis: Analysis, title: str = "") -> str:
    """Print peaks, harmonics and period as tables, in mm, mm/s and g.

    Args:
        analysis: Analysis from `gapbeam.postprocess.signals.probe_analysis.analyze`.
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
            "residual": finite_or_none(period.residual),
            "remaining": finite_or_none(period.remaining),
            "repeats": period.repeats,
            "transient": period.transient,
            "longest": period.longest,
            "tolerance": period.tolerance,
            "verdict": period.verdict,
        },
        "warnings": list(analysis.warnings),
    }


def _peak_rows(analysis: Analysis) -> list[str]:
    rows = ["Peaks", f"  {'':24}{'minimum':>12}{'at s':>12}{'maximum':>12}{'at s':>12}{'peak to peak':>14}"]
    for name, one in analysis.signals.items():
        unit, factor = _plain(one)
        found = one.peaks
        rows.append(
            f"  {f'{name}, {unit}':24}{factor * found.minimum:12.5g}{found.time_of_minimum:12.5g}"
            f"{factor * found.maximum:12.5g}{found.time_of_maximum:12.5g}{factor * found.peak_to_peak:14.5g}"
        )
    with_periods = [
        (name, *_plain(one), one.per_period) for name, one in analysis.signals.items() if one.per_period is not None
    ]
    if with_periods:
        rows += ["", "Peak to peak in a forcing period, over the last half of the periods"]
        rows.append(f"  {'':24}{'median':>12}{'smallest':>12}{'largest':>12}")
    for name, unit, factor, table in with_periods:
        values = factor * table.peak_to_peak[-max(1, table.period.size // 2) :]
        rows.append(f"  {f'{name}, {unit}':24}{np.median(values):12.5g}{values.min():12.5g}{values.max():12.5g}")
    return rows


def _harmonic_rows(analysis: Analysis) -> list[str]:
    columns = {name: one for name, one in analysis.signals.items() if one.harmonics}
    heads = "".join(f"{f'{name}, {_plain(one)[0]}':>28}" for name, one in columns.items())
    rows = ["Amplitudes of harmonics", f"  {'order':>6}{'Hz':>10}{heads}"]
    by_order = {name: {row.order: row for row in one.harmonics} for name, one in columns.items()}
    orders = sorted({order for table in by_order.values() for order in table})
    for order in orders:
        frequency = float(order) * (analysis.forcing_frequency or 0.0)
        cells = "".join(f"{_cell(by_order[name].get(order), _plain(one)[1]):>28}" for name, one in columns.items())
        rows.append(f"  {order!s:>6}{frequency:10.5g}{cells}")
    rest = "".join(f"{distortion(one.harmonics):28.4g}" for one in columns.values())
    rows.append(f"  {'higher harmonics/first':>16}{rest[6:]}")
    spans = ", ".join(
        f"{name} {one.spectrum.periods} periods from {one.spectrum.start:.4g} s, {one.spectrum.window}"
        for name, one in columns.items()
        if one.spectrum is not None
    )
    return [*rows, f"  spans: {spans}"]


def _plain(one: SignalAnalysis) -> tuple[str, float]:
    """Return the unit of a signal in plain letters, for terminals, and the factor to it."""
    unit, factor = one.display
    return unit.replace("µ", "u"), factor


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
            "resolution": 1.0 / (lines.end - lines.start),
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
