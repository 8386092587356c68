"""Figures of a signal: history, peaks in every forcing period, spectra, phase portrait and Poincaré section."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, COLORS, GRAY, VERMILION, letter, limits_around, panels
from gapbeam.postprocess.signals.cycle_counts import CycleCounts
from gapbeam.postprocess.signals.probe_analysis import Analysis, SignalAnalysis
from gapbeam.postprocess.signals.shock_spectrum import CONFIDENCE, PowerDensity, ShockSpectrum
from gapbeam.postprocess.signals.signal import Signal, enlarged_span, unit_of_record, unit_of_time

_DECADES = 4.0
_SHORT = {"1/2": "½", "1/3": "⅓"}


def draw_amplitude_spectrum(analysis: Analysis, highest: int = 10) -> Figure:
    """Draw amplitude over frequency: displacement left, acceleration right, on logarithmic axes of amplitude.

    Args:
        analysis: Analysis with at least one spectrum.
        highest: Highest harmonic shown; without forcing the whole band is.
    """
    left, right = analysis.displacement, analysis.acceleration
    shown_panels = [one for one in (left, right) if one is not None and one.spectrum is not None]
    figure, axes = panels(1, len(shown_panels), height=2.5)
    frequency = analysis.forcing_frequency
    for panel, one in zip(axes[0], shown_panels, strict=True):
        smoothed = analysis.smoothed if one is right else None
        smoothed = smoothed if smoothed is not None and smoothed.spectrum is not None else None
        _lines(panel, one, BLACK if smoothed is None else GRAY, "as recorded")
        _marks(panel, one, BLACK if smoothed is None else GRAY, filled=True)
        if smoothed is not None:
            _lines(panel, smoothed, BLACK, "moving average")
            _marks(panel, smoothed, BLACK, filled=False)
            figure.legend(*panel.get_legend_handles_labels(), loc="outside upper right", ncols=2)
        unit, _ = one.display
        panel.set_xlabel("frequency (Hz)")
        panel.set_ylabel(f"amplitude of {one.signal.name} ({unit})")
        _limits(panel, [part for part in (one, smoothed) if part is not None], frequency, highest)
        if frequency is not None:
            _orders(panel, one, frequency, highest)
    letter(list(axes.flat), pad=11.0)
    return figure


def _lines(panel: Axes, one: SignalAnalysis, color: str, label: str) -> None:
    lines = one.spectrum
    assert lines is not None
    _, factor = one.display
    panel.semilogy(
        lines.frequency[1:],
        np.maximum(factor * lines.amplitude[1:], 1e-300),
        color=color,
        lw=0.8,
        label=label,
    )


def _marks(panel: Axes, one: SignalAnalysis, color: str, filled: bool) -> None:
    _, factor = one.display
    for row in one.harmonics:
        whole = row.order.denominator == 1
        if not whole and not filled:
            continue
        panel.plot(
            row.frequency,
            factor * row.amplitude,
            marker="o" if whole else "D",
            ms=3.2 if whole else 3.6,
            color=color if whole else BLUE,
            mfc=color if filled and whole else "white",
            mew=0.8,
            zorder=5,
        )


def _limits(panel: Axes, parts: list[SignalAnalysis], frequency: float | None, highest: int) -> None:
    tops, floors = [], []
    limit = np.inf if frequency is None else (highest + 0.5) * frequency
    for one in parts:
        lines = one.spectrum
        assert lines is not None
        amplitude = one.display[1] * lines.amplitude[1:][lines.frequency[1:] <= limit]
        tops.append(float(amplitude.max()))
        floors.append(float(np.median(amplitude)))
        floors += [one.display[1] * row.amplitude for row in one.harmonics]
    top = max(tops) or 1.0
    floor = max(min([value for value in floors if value > 0.0] or [top]), 10.0**-_DECADES * top)
    panel.set_ylim(0.3 * min(floor, 1e-2 * top), 2.5 * top)
    spectrum = parts[0].spectrum
    assert spectrum is not None
    panel.set_xlim(0.0, min(limit, float(spectrum.frequency[-1])))
    panel.yaxis.set_major_locator(LogLocator(10.0, numticks=9))
    panel.yaxis.set_minor_locator(LogLocator(10.0, subs=tuple(range(2, 10)), numticks=9))
    panel.yaxis.set_minor_formatter(NullFormatter())


def _orders(panel: Axes, one: SignalAnalysis, frequency: float, highest: int) -> None:
    """Number the harmonics along the top."""
    for order in range(1, highest + 1):
        if order * frequency <= panel.get_xlim()[1]:
            panel.axvline(order * frequency, color=GRAY, lw=0.4, ls=":", zorder=0)
    for row in one.harmonics:
        panel.text(
            row.frequency, 1.01, _SHORT.get(str(row.order), str(row.order)),
            transform=panel.get_xaxis_transform(), fontsize=7, va="bottom",
            ha="right" if str(row.order) == "1/3" else "center",
        )  # fmt: skip


_NARROW = 0.02


def draw_time_history(analysis: Analysis, zoom: int = 3) -> Figure:
    """Draw displacement and acceleration, raw and smoothed; left the whole record, right a part of it.

    Args:
        analysis: Analysis with a displacement.
        zoom: Forcing periods on the right; without forcing the tenth of the record where most happens.
    """
    rows = [signal for signal in (analysis.displacement, analysis.acceleration) if signal is not None]
    figure, axes = panels(len(rows), 2, height=1.75, sharey="row", sharex="col", width_ratios=[1.5, 1.0])
    frequency = analysis.forcing_frequency
    motion = rows[-1].signal
    span = enlarged_span(motion.time, motion.values, frequency, zoom)
    (time_unit, in_unit), (clock, in_record) = unit_of_time(span), unit_of_record(motion.time)
    for row, (whole, end) in zip(rows, axes, strict=True):
        if frequency is not None:  # each record to its own end
            span = enlarged_span(row.signal.time, row.signal.values, frequency, zoom)
        signal, last = row.signal, row.signal.between(*span)
        unit, factor = row.display
        smoothed = analysis.smoothed.signal if analysis.smoothed and row is analysis.acceleration else None
        for panel, part, scale in ((whole, signal, in_record), (end, last, in_unit)):
            if smoothed is None:
                panel.plot(scale * part.time, factor * part.values, color=BLACK, lw=0.7)
            else:
                _both(panel, part, smoothed, factor, scale, thin=panel is whole)
        limits_around(whole, factor * signal.values)
        whole.axvspan(in_record * last.time[0], in_record * last.time[-1], color=GRAY, alpha=0.25, lw=0)
        whole.set_ylabel(f"{signal.name} ({unit})")
        if smoothed is not None:
            end.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, borderaxespad=0.0, columnspacing=1.2)
        if frequency is not None:
            _period_grid(end, last, frequency, in_unit)
    axes[-1][0].set_xlabel(f"time ({clock})")
    axes[-1][1].set_xlabel(f"time ({time_unit})")
    for panel in (axes[-1][0], axes[-1][1]):
        panel.locator_params(axis="x", nbins=7)
    letter(list(axes.flat))
    return figure


def _both(panel: Axes, raw: Signal, smoothed: Signal, factor: float, scale: float, thin: bool) -> None:
    panel.plot(scale * raw.time, factor * raw.values, color=GRAY, lw=0.5, label="as recorded")
    keep = (smoothed.time >= raw.time[0]) & (smoothed.time <= raw.time[-1])
    panel.plot(
        scale * smoothed.time[keep],
        factor * smoothed.values[keep],
        color=BLACK,
        lw=0.6 if thin else 1.1,
        label="moving average",
    )


def _period_grid(panel: Axes, part: Signal, frequency: float, in_unit: float) -> None:
    first = np.ceil(part.time[0] * frequency - _NARROW)
    for j in np.arange(first, np.floor(part.time[-1] * frequency + _NARROW) + 1):
        panel.axvline(in_unit * j / frequency, color=GRAY, lw=0.5, ls=":", zorder=0)


def draw_period_peaks(analysis: Analysis) -> Figure:
    """Draw extremes per forcing period of displacement, acceleration and smoothed acceleration.

    Args:
        analysis: Analysis with at least one signal that lasts a forcing period.
    """
    names = ("displacement", "acceleration", "smoothed acceleration")
    rows = [(name, analysis.signals[name]) for name in names if name in analysis.signals]
    rows = [(name, one) for name, one in rows if one.per_period is not None]
    figure, axes = panels(1, len(rows), height=2.1, sharex=True)
    for panel, (name, one) in zip(axes[0], rows, strict=True):
        unit, factor = one.display
        table = one.per_period
        assert table is not None
        panel.plot(table.period, factor * table.maximum, "o-", color=BLACK, ms=2.6, lw=0.6, label="maximum")
        panel.plot(
            table.period,
            factor * table.minimum,
            "s--",
            color=VERMILION,
            ms=2.6,
            lw=0.6,
            mfc="white",
            label="minimum",
        )
        panel.axhline(0.0, color=GRAY, lw=0.5, zorder=0)
        panel.set_xlabel("forcing period")
        panel.set_ylabel(f"{name} ({unit})")
        panel.margins(x=0.03, y=0.12)
        panel.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    letter(list(axes.flat))
    return figure


def draw_phase_portrait(analysis: Analysis) -> Figure:
    """Draw velocity over displacement, and the displacement once per forcing period.

    The portrait shows the settled response, or the last twelve periods where it has not settled.

    Args:
        analysis: Analysis with displacement and velocity; without a section only the portrait of the whole record is
            drawn.
    """
    assert analysis.displacement is not None
    assert analysis.velocity is not None
    displacement, velocity = analysis.displacement.signal, analysis.velocity.signal
    section, found = analysis.section, analysis.periodicity
    (length_unit, length), (speed_unit, speed) = analysis.displacement.display, analysis.velocity.display
    figure, axes = panels(1, 1 if section is None else 2, height=2.6)
    portrait = axes[0][0]
    start = analysis.settled_since()
    shown_part = slice(int(np.searchsorted(displacement.time, start)), None)
    portrait.plot(
        length * displacement.values[shown_part],
        speed * velocity.values[shown_part],
        color=GRAY,
        lw=0.6,
        zorder=1,
    )
    portrait.set_xlabel(f"displacement ({length_unit})")
    portrait.set_ylabel(f"velocity ({speed_unit})")
    portrait.margins(x=0.05, y=0.05)
    if section is None or analysis.forcing_frequency is None:
        return figure
    settled = analysis.settled_states()
    portrait.plot(
        length * section.displacement[settled],
        speed * section.velocity[settled],
        "o", color=VERMILION, ms=3.5, mec=BLACK, mew=0.4, zorder=3,
    )  # fmt: skip
    strobe = axes[0][1]
    number = np.round(section.time * analysis.forcing_frequency)
    strobe.plot(number, length * section.displacement, "o", color=BLACK, ms=2.6, mfc="white", mew=0.7)
    strobe.plot(
        number[settled],
        length * section.displacement[settled],
        "o",
        color=VERMILION,
        ms=2.8,
        mec=BLACK,
        mew=0.4,
    )
    strobe.set_xlabel("forcing period")
    strobe.set_ylabel(f"displacement at its start ({length_unit})")
    strobe.margins(x=0.03, y=0.08)
    strobe.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    if found is not None and found.transient is not None:
        strobe.axvline(found.transient * analysis.forcing_frequency, color=GRAY, lw=0.6, ls="--", zorder=0)
    letter([portrait, strobe])
    return figure


_STYLES = ("-", "--", ":", "-.")


def draw_shock_spectrum(found: ShockSpectrum) -> Figure:
    """Draw the largest responses over natural frequency, both logarithmic."""
    unit, factor = shown(found.unit)
    figure, ((panel,),) = panels(1, 1, height=3.0)
    for number, ((kind, label), heights) in enumerate(found.responses.items()):
        values = np.maximum(factor * heights, 1e-300)
        panel.loglog(found.frequency, values, label=f"{label} {kind}".strip(), **_line(number))
    panel.set_xlabel("natural frequency (Hz)")
    panel.set_ylabel(f"largest response to {found.record.replace('_', ' ')} ({unit})")
    panel.set_xlim(found.frequency[0], found.frequency[-1])
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def draw_cycles(found: CycleCounts) -> Figure:
    """Draw the number of cycles with at least a range over that range."""
    unit, factor = shown(found.unit)
    figure, ((panel,),) = panels(1, 1, height=3.0)
    for number, (label, (ranges, _, counts)) in enumerate(found.cycles.items()):
        order = np.argsort(-ranges)
        panel.step(np.cumsum(counts[order]), factor * ranges[order], where="pre", label=label, **_line(number))
    panel.set_xscale("log")
    panel.set_xlabel("cycles with at least this range")
    panel.set_ylabel(f"range of {found.record.replace('_', ' ')} ({unit})")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _line(number: int) -> dict[str, object]:
    style = _STYLES[number // len(COLORS) % len(_STYLES)]
    return {"color": COLORS[number % len(COLORS)], "linestyle": style, "linewidth": 0.9}


_DENSITY_DECADES = 9.0


def draw_power_density(found: PowerDensity) -> Figure:
    """Draw density over frequency, both logarithmic, a line for each probe, face or component.

    Args:
        found: Densities of at least one column.
    """
    unit, factor = shown(found.unit)
    figure, ((panel,),) = panels(1, 1, height=3.0)
    top = 0.0
    for number, (label, density) in enumerate(found.densities.items()):
        values = factor * factor * density
        top = max(top, float(values.max()))
        style = _STYLES[number // len(COLORS) % len(_STYLES)]
        color = COLORS[number % len(COLORS)]
        panel.loglog(found.frequency, np.maximum(values, 1e-300), color=color, ls=style, lw=0.9, label=label)
    panel.set_ylim(max(panel.get_ylim()[0], 10.0**-_DENSITY_DECADES * top), 3.0 * top)
    panel.set_xlabel("frequency (Hz)")
    square = f"({unit})²" if "/" in unit else f"{unit}²" if unit != "1" else "1"
    panel.set_ylabel(f"density of {found.record.replace('_', ' ')} ({square}/Hz)")
    panel.set_xlim(found.frequency[0], found.frequency[-1])
    low, high = panel.get_ylim()
    middle, place = low * (high / low) ** 0.15, found.frequency[0] * (found.frequency[-1] / found.frequency[0]) ** 0.03
    spans = [[middle * (1.0 - found.least)], [middle * (found.most - 1.0)]]
    panel.errorbar([place], [middle], spans, color=GRAY, capsize=2.0, lw=0.9, label=f"{CONFIDENCE:.0%} of any value")
    figure.legend(*panel.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure
