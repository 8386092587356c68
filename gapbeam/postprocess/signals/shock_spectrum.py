"""Shock response spectra: the largest responses of oscillators of one DOF whose base moves as a record does.

    z'' + 2 zeta w z' + w^2 z = -a(t),    absolute: max |a + z''|,    pseudo: max w^2 |z|

from rest, over the record. The filters are exact for a that is linear between its values (ramp invariant). To a force
in place of a the pseudo spectrum is the static force of the same deflection.

Source: Smallwood, Shock Vib. Bull. 51 (1981) 279; ISO 18431-4, equations of the relative displacement.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, pi, sin, sqrt

import numpy as np
import xarray as xr
from scipy.signal import lfilter

from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.record_columns import record_columns
from gapbeam.postprocess.signals.signal import SignalError

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
        history: That holds the record, evenly spaced.
        record: Of accelerations or forces.
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
            f"{record}: {first.time.size} values; expected at least {2.0 / HIGHEST:g} for a shock spectrum"
        )
    frequency = 2.0 ** (np.arange(int(PER_OCTAVE * octaves) + 1) / PER_OCTAVE) / span
    responses = {
        (kind, label): np.array([largest_response(one.values, interval, f, damping, kind) for f in frequency])
        for kind in KINDS[unit]
        for label, one in columns.items()
    }
    return ShockSpectrum(record, unit, damping, frequency, responses)


def largest_response(values: np.ndarray, interval: float, frequency: float, damping: float, kind: str) -> float:
    """Return the largest response of an oscillator to values at even distances in time, in their unit.

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
    return float(np.abs(lfilter(rows, (1.0, -2.0 * c, decay * decay), values)).max())


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
