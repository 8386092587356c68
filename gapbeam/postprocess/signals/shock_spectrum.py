"""Spectra of records: shock response spectra, and power spectral densities with intervals.

A shock response spectrum holds the largest responses of oscillators of one DOF whose base moves as the record does,

    z'' + 2 zeta w z' + w^2 z = -a(t),    absolute: max |a + z''|,    pseudo: max w^2 |z|

from rest, over the record. The filters are exact for a that is linear between its values (ramp invariant). To a force
in place of a the pseudo spectrum is the static force of the same deflection.

Power spectral densities follow from Welch's method: the record is cut into windows that overlap by half and are
weighted by Hann's; the squares of their transforms, without their means, are averaged. Densities are one-sided: their
integral over frequency is the mean square. The mean of K windows is taken as chi-squared with
2 K / (1 + (1 - 1/K) / 18) degrees of freedom, as neighbors share a little.

Source: Smallwood, Shock Vib. Bull. 51 (1981) 279; ISO 18431-4, equations of the relative displacement. Welch, IEEE
Trans. Audio Electroacoust. 15 (1967); Percival and Walden, Spectral Analysis (1993), chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, pi, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
import scipy

from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.signal import INTERVAL_MEANS, SignalError, record_columns, units_of
from gapbeam.solver.messages.wording import counted

if TYPE_CHECKING:
    import xarray as xr

DAMPING = 0.05  # of critical: Q = 10
PER_OCTAVE = 12
HIGHEST = 0.1  # of the sampling rate: ten values in a period, whose largest is 5 % below the peak at most
KINDS = {"m/s^2": ("absolute", "pseudo"), "N": ("pseudo",)}


@dataclass(frozen=True)
class ShockSpectrum:
    """The spectra of a record.

    Attributes:
        record: Its name.
        unit: SI unit of record and responses.
        damping: zeta.
        frequency: Natural frequencies, (k,), Hz.
        responses: (k,), by kind and label of the column.
    """

    record: str
    unit: str
    damping: float
    frequency: np.ndarray
    responses: dict[tuple[str, str], np.ndarray]


def shock_spectrum(history: xr.Dataset, record: str, damping: float = DAMPING) -> ShockSpectrum:
    """Return the shock response spectra of the columns of a record that move.

    Args:
        history: History that holds the record, evenly spaced.
        record: Record of accelerations or forces.
        damping: zeta, at least 0, below 1.

    Raises:
        OptionError: Another damping, or a record of other things.
        SignalError: Too short a record, or one that does not move.
    """
    if not 0.0 <= damping < 1.0:
        raise OptionError(f"damping = {damping:g}; expected a ratio of at least 0 and below 1, such as 0.05 for Q = 10")
    unit = str(history[record].attrs.get("units", "1"))
    if unit not in KINDS:
        raise OptionError(
            f"{record} is in {unit}, and shock spectra are of accelerations and forces; expected a record such as "
            "acceleration_absolute or contact_force"
        )
    columns = {label: one for label, one in record_columns(history, record).items() if np.ptp(one.values) > 0.0}
    if not columns:
        raise SignalError(f"{record}: no value changes, there is no shock")
    first = next(iter(columns.values()))
    interval, span = first.interval, first.interval * first.time.size
    octaves = np.log2(HIGHEST / interval * span)
    if octaves < 1.0:
        raise SignalError(
            f"{record}: {counted(first.time.size, 'value')}; expected at least {2.0 / HIGHEST:g} for a shock spectrum"
        )
    frequency = 2.0 ** (np.arange(int(PER_OCTAVE * octaves) + 1) / PER_OCTAVE) / span
    responses = {
        (kind, label): np.array([largest_response(one.values, interval, f, damping, kind) for f in frequency])
        for kind in KINDS[unit]
        for label, one in columns.items()
    }
    return ShockSpectrum(record, units_of(columns.values()), damping, frequency, responses)


def largest_response(values: np.ndarray, interval: float, frequency: float, damping: float, kind: str) -> float:
    """Return the largest response of an oscillator to values at even distances in time; see `responses`."""
    return float(np.abs(responses(values, interval, frequency, damping, kind)).max())


def responses(values: np.ndarray, interval: float, frequency: float, damping: float, kind: str) -> np.ndarray:
    """Return the response of an oscillator at each of the times of values, which are even, in their unit.

    Args:
        values: a, (n,).
        interval: Time between them, s.
        frequency: Natural frequency, Hz.
        damping: zeta.
        kind: "absolute" or "pseudo".
    """
    w, root = 2.0 * pi * frequency, sqrt(1.0 - damping * damping)
    decay, angle = exp(-damping * w * interval), w * root * interval
    c, s = decay * cos(angle), decay * sin(angle)
    if kind == "absolute":
        ratio = s / angle
        rows = (1.0 - ratio, 2.0 * (ratio - c), decay * decay - ratio)
    else:
        step, mixed = w * interval, (2.0 * damping * damping - 1.0) / root * s
        rows = (
            (2.0 * damping * (c - 1.0) + mixed + step) / step,
            (-2.0 * step * c + 2.0 * damping * (1.0 - decay * decay) - 2.0 * mixed) / step,
            (decay * decay * (step + 2.0 * damping) - 2.0 * damping * c + mixed) / step,
        )
    return np.asarray(scipy.signal.lfilter(rows, (1.0, -2.0 * c, decay * decay), values))


def shock_rows(found: ShockSpectrum) -> list[str]:
    """Return lines of text: the largest response of every column."""
    rows = [
        f"Shock response of {found.record}, {found.unit}: damping ratio {found.damping:g}, "
        f"{found.frequency[0]:.4g} to {found.frequency[-1]:.4g} Hz",
        f"  {'':32}{'largest':>12}{'at Hz':>10}",
    ]
    for (kind, label), heights in found.responses.items():
        top = int(np.argmax(heights))
        rows.append(f"  {f'{label} {kind}'.strip():32}{heights[top]:12.5g}{found.frequency[top]:10.5g}")
    return rows


def shock_data(found: ShockSpectrum) -> dict[str, object]:
    """Return the spectra as plain data."""
    return {
        "unit": found.unit,
        "damping": found.damping,
        "frequency": found.frequency.tolist(),
        "responses": {f"{label} {kind}".strip(): one.tolist() for (kind, label), one in found.responses.items()},
    }


WINDOWS = 16  # in the record where no resolution is given
LEAST = 8  # values in a window
CONFIDENCE = 0.95


@dataclass(frozen=True)
class PowerDensity:
    """The densities of a record, one for each of its probes, faces and components.

    Attributes:
        record: Its name.
        unit: SI unit of the record; densities have its square over Hz.
        frequency: (k,), Hz, from one over the length of a window to half the sampling rate.
        densities: (k,) by the labels of the column, without those that do not change.
        rms: Rms of each column, about its mean, in the unit.
        windows: Number of averaged windows.
        least: Factor on a density to the lower end of its 95 % interval.
        most: Factor to the upper end.
        notes: Warnings.
    """

    record: str
    unit: str
    frequency: np.ndarray
    densities: dict[str, np.ndarray]
    rms: dict[str, float]
    windows: int
    least: float
    most: float
    notes: tuple[str, ...] = ()

    @property
    def resolution(self) -> float:
        """Spacing of the frequencies, Hz."""
        return float(self.frequency[0])


def power_density(history: xr.Dataset, record: str, resolution: float | None = None) -> PowerDensity:
    """Return the power spectral densities of a record.

    Args:
        history: History that holds the record, evenly spaced except for a last interval of other length.
        record: Its name.
        resolution: One over the length of a window, Hz; None: so that there are 16 windows.

    Raises:
        SignalError: Too short a record, for the resolution or at all; values that are not finite, or unevenly spaced.
    """
    columns = record_columns(history, record)
    notes = []
    if record in INTERVAL_MEANS:
        notes.append(f"{record} is the mean over a record interval h: it takes (sin(pi f h) / (pi f h))^2 of its power")
    first = next(iter(columns.values()))
    time, unit = first.time, units_of(columns.values())
    interval = first.interval
    size = _window_size(record, time.size, interval, resolution)
    moving = {label: one.values for label, one in columns.items() if np.ptp(one.values) > 0.0}
    if not moving:
        raise SignalError(f"{record}: no value changes, there is no power to find")
    found = {
        label: scipy.signal.welch(one, 1.0 / interval, "hann", size, size // 2)[1][1:] for label, one in moving.items()
    }
    windows = (time.size - size // 2) // (size - size // 2)
    freedom = 2.0 * windows / (1.0 + (1.0 - 1.0 / windows) / 18.0)
    least, most = (
        float(freedom / scipy.stats.chi2.ppf(0.5 + 0.5 * sign * CONFIDENCE, freedom)) for sign in (1.0, -1.0)
    )
    frequency = np.fft.rfftfreq(size, interval)[1:]
    rms = {label: float(np.std(one)) for label, one in moving.items()}
    return PowerDensity(record, unit, frequency, found, rms, windows, least, most, tuple(notes))


def density_rows(found: PowerDensity) -> list[str]:
    """Return lines of text: rms and the strongest frequency of every column."""
    rows = [
        f"Power density of {found.record}, ({found.unit})^2/Hz: {counted(found.windows, 'window')}, every "
        f"{found.resolution:.4g} "
        f"Hz, {CONFIDENCE:.0%} between {found.least:.3g} and {found.most:.3g} of each value",
        f"  {'':32}{'rms':>12}{'largest':>12}{'at Hz':>10}",
    ]
    for label, density in found.densities.items():
        top = int(np.argmax(density))
        rows.append(f"  {label:32}{found.rms[label]:12.5g}{density[top]:12.5g}{found.frequency[top]:10.5g}")
    return [*rows, *(f"  {note}" for note in found.notes)]


def density_data(found: PowerDensity) -> dict[str, object]:
    """Return the densities as plain data."""
    return {
        "unit": found.unit,
        "windows": found.windows,
        "confidence": CONFIDENCE,
        "least_factor": found.least,
        "most_factor": found.most,
        "frequency": found.frequency.tolist(),
        "columns": {
            label: {"rms": found.rms[label], "density": density.tolist()} for label, density in found.densities.items()
        },
        "notes": list(found.notes),
    }


def _window_size(record: str, count: int, interval: float, resolution: float | None) -> int:
    size = 2 * (count // (WINDOWS + 1)) if resolution is None else round(1.0 / (resolution * interval))
    if resolution is not None and size > count:
        raise SignalError(
            f"{record}: a resolution of {resolution:g} Hz takes {1.0 / resolution:.4g} s, and the record has "
            f"{count * interval:.4g} s; at least {1.0 / (count * interval):.4g} Hz is possible"
        )
    if size < LEAST:
        words = (
            "too few" if resolution is None else f"a resolution of {resolution:g} Hz leaves {size} in a window, too few"
        )
        raise SignalError(
            f"{record}: {counted(count, 'value')}; {words} for a power density, which takes {LEAST} in a window"
        )
    return size
