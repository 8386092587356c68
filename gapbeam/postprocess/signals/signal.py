"""Signals of a run over time: one quantity or all columns of a record, and extremes in every forcing period."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from gapbeam.postprocess.display_units import PREFIXES, shown
from gapbeam.solver.schema.record_table import HISTORY, STRUCK, TURNING, unit_where

if TYPE_CHECKING:
    import xarray as xr


# Records that hold the mean over the interval that ends at t.
INTERVAL_MEANS = frozenset(record.name for record in HISTORY if "mean over the interval" in record.meaning)

_UNEVEN = 1.0e-3
LEAST_IN_S = 0.01  # ends of whole records whose times are in s


class SignalError(ValueError):
    """A signal is missing, not finite, or too short for the request."""

    exit_status = 2


class SignalWarning(UserWarning):
    """A signal from which a number was computed that should be read with care."""


@dataclass(frozen=True)
class Signal:
    """Values of one quantity over time.

    Attributes:
        time: (n,), s, strictly increasing: the middle of the time that each value stands for.
        values: (n,), finite, in `unit`.
        unit: SI unit.
        name: Name, in one or two words.
        width: Time in s over which each value is a mean; 0 for values at an instant.

    Raises:
        SignalError: Shapes that differ, no value, times that do not increase, or a value that is not finite.
    """

    time: np.ndarray
    values: np.ndarray
    unit: str
    name: str
    width: float = 0.0

    def __post_init__(self) -> None:
        if self.time.ndim != 1 or self.time.shape != self.values.shape:
            raise SignalError(f"{self.name}: times {self.time.shape} and values {self.values.shape} differ in shape")
        if self.time.size == 0:
            raise SignalError(f"{self.name}: the record holds no value")
        bad = ~np.isfinite(self.values) | ~np.isfinite(self.time)
        if bad.any():
            raise SignalError(
                f"{self.name}: {int(bad.sum())} of {bad.size} values are not finite, "
                f"the first at t = {self.time[np.argmax(bad)]:g} s"
            )
        if (np.diff(self.time) <= 0.0).any():
            raise SignalError(f"{self.name}: the times of the record do not increase")

    @property
    def interval(self) -> float:
        """Sampling interval in s; of a single mean, the time it is the mean of.

        Raises:
            SignalError: Fewer than two values, or the intervals differ by more than 0.1 %.
        """
        if self.time.size == 1 and self.width > 0.0:
            return self.width
        if self.time.size < 2:
            raise SignalError(f"{self.name}: one value has no sampling interval; record more of them")
        interval = float(self.time[-1] - self.time[0]) / (self.time.size - 1)
        if np.abs(np.diff(self.time) - interval).max() > _UNEVEN * interval:
            raise SignalError(f"{self.name}: the times of the record are not evenly spaced")
        return interval

    @property
    def duration(self) -> float:
        """Time in s that the values stand for: n sampling intervals."""
        return self.time.size * self.interval

    def between(self, start: float, end: float) -> Signal:
        """The part from a time to another, s; where no value lies between them, the one nearest to the start."""
        slack = _UNEVEN * (float(np.diff(self.time).min()) if self.time.size > 1 else 0.0)
        keep = (self.time >= start - slack) & (self.time <= end + slack)
        if not keep.any():
            keep[np.argmin(np.abs(self.time - start))] = True
        return replace(self, time=self.time[keep], values=self.values[keep])


def unit_at(history: xr.Dataset, record: str, labels: Iterable[str]) -> str:
    """Return the SI unit of a record at a probe or face: of one that rotates rad and N m in place of m and N.

    Args:
        history: History that holds the record.
        record: Its name.
        labels: Names along its dimensions.
    """
    unit = str(history[record].attrs.get("units", "1"))
    return unit_where(unit, not turning_in(history).isdisjoint(labels))


def finite_record(history: xr.Dataset, name: str) -> np.ndarray:
    """Return the values of a record.

    Raises:
        SignalError: A value is not finite.
    """
    values = np.asarray(history[name].values, dtype=float)
    if not np.isfinite(values).all():
        raise SignalError(f"{name}: a value is not finite")
    return values


def turning_in(history: xr.Dataset) -> set[str]:
    """Return the names of probes that are rotations, and of faces between them."""
    return set(history[TURNING].values.tolist()) if TURNING in history.coords else set()


def struck_in(history: xr.Dataset) -> set[str]:
    """Return the names of faces of impulses, and of probes of what they strike."""
    return set(history[STRUCK].values.tolist()) if STRUCK in history.coords else set()


def smooth_motions(history: xr.Dataset, probe: str, component: str | None = None) -> tuple[Signal, ...]:
    """Return displacement and velocity of a probe, without the velocity where impulses make it jump."""
    names = ("displacement",) if probe in struck_in(history) else ("displacement", "velocity")
    return tuple(probe_signal(history, name, probe, component) for name in names)


def units_of(signals: Iterable[Signal]) -> str:
    """Return the unit of signals: "N", or "N or N m" where they differ."""
    return " or ".join(dict.fromkeys(one.unit for one in signals))


def display_of(signals: Iterable[Signal], side: int = 0) -> tuple[str, float]:
    """Return the unit in which signals are shown together, by the largest of them, and the factor to it.

    Args:
        signals: Signals.
        side: 1 or -1: of values above or below 0 alone.
    """
    signals = list(signals)
    units = list(dict.fromkeys(one.unit for one in signals)) or [""]
    sizes = [float((side * one.values if side else np.abs(one.values)).max(initial=0.0)) for one in signals]
    if len(units) > 1 and units[0] not in PREFIXES:
        return units_of(signals), 1.0
    label, factor = shown(units[0], max(sizes, default=0.0))
    prefix = label.removesuffix(units[0])
    return " or ".join([label, *(prefix + unit for unit in units[1:])]), factor


def probe_signal(history: xr.Dataset, quantity: str, probe: str | None = None, component: str | None = None) -> Signal:
    """Pick one component of the motion of one probe.

    A record of interval means (the accelerations) is placed at the middle of its intervals, and its first
    entry, which no interval precedes, is left out. A last interval of other length is left out too.

    Args:
        history: The history of a run, `Results.history`.
        quantity: "displacement", "velocity", "acceleration_relative" or "acceleration_absolute".
        probe: Name of the probe; default the first.
        component: "x", "y" or "z"; default the bending direction.

    Raises:
        SignalError: No such quantity, probe or component; too few or not finite values.
    """
    probe = probe_name(history, probe)
    component = component_name(history, component)
    if quantity not in history:
        raise SignalError(f"the history holds no {quantity}")
    variable = history[quantity].sel(probe=probe, component=component)
    time = np.asarray(history["time"].values, dtype=float)
    values = np.asarray(variable.values, dtype=float)
    if time.size > 2 and abs(time[-1] - 2 * time[-2] + time[-3]) > _UNEVEN * (time[-2] - time[-3]):
        time, values = time[:-1], values[:-1]
    name, unit = quantity.split("_", maxsplit=1)[0], unit_at(history, quantity, [probe])
    if quantity not in INTERVAL_MEANS:
        return Signal(time, values, unit, name)
    if time.size < 2:
        raise SignalError(f"{quantity}: a mean over intervals needs two records, there is one")
    width = float(time[-1] - time[0]) / (time.size - 1)
    middle = 0.5 * (time[1:] + time[:-1])
    return Signal(middle, values[1:], unit, name, width)


def face_signal(history: xr.Dataset, quantity: str, face: str) -> Signal:
    """Pick a record of a contact face.

    Args:
        history: The history of a run, `Results.history`.
        quantity: "contact_force", "penetration", ...
        face: "base" or "gland".

    Raises:
        SignalError: A value is not finite.
    """
    variable = history[quantity].sel(face=face)
    return Signal(
        np.asarray(history["time"].values, dtype=float),
        np.asarray(variable.values, dtype=float),
        unit_at(history, quantity, [face]),
        f"{quantity} at the {face}",
    )


def names_along(history: xr.Dataset, dimension: str) -> list[str]:
    """Return the names along a dimension, such as "probe" or "face"; none where the history has no such dimension."""
    return [str(name) for name in history[dimension].values] if dimension in history.coords else []


def probes_of(history: xr.Dataset) -> list[str]:
    """Return the names of the probes.

    Raises:
        SignalError: No probe at all.
    """
    probes = names_along(history, "probe")
    if not probes:
        raise SignalError("the run recorded no probe; add [[probe]] to the case")
    return probes


def probe_name(history: xr.Dataset, probe: str | None = None) -> str:
    """The probe asked for, or the first.

    Raises:
        SignalError: No probe at all, or none of that name.
    """
    probes = probes_of(history)
    if probe is not None and probe not in probes:
        raise SignalError(f"no probe named {probe!r}; there are {', '.join(probes)}")
    return probes[0] if probe is None else probe


def component_name(history: xr.Dataset, component: str | None = None) -> str:
    """The component asked for, or the bending direction: y of two components, z of three.

    Raises:
        SignalError: None of that name.
    """
    components = names_along(history, "component")
    if not components:
        raise SignalError("the history has no components")
    if component is not None and component not in components:
        raise SignalError(f"no component {component!r}; there are {', '.join(components)}")
    return components[-1] if component is None else component


_PHASE_SLACK = 1.0e-6


@dataclass(frozen=True)
class SignalPeaks:
    """Extremes of a signal over one span.

    Attributes:
        maximum: Largest value, in the unit of the signal.
        minimum: Smallest value.
        time_of_maximum: s, the first time it is met.
        time_of_minimum: s, the first time it is met.
    """

    maximum: float
    minimum: float
    time_of_maximum: float
    time_of_minimum: float

    @property
    def peak_to_peak(self) -> float:
        """Maximum minus minimum."""
        return self.maximum - self.minimum


@dataclass(frozen=True)
class PeriodPeaks:
    """Extremes in every whole forcing period.

    Attributes:
        period: Indices of the forcing periods, (k,); period j spans j/f <= t < (j+1)/f.
        maximum: (k,), in the unit of the signal.
        minimum: (k,).
    """

    period: np.ndarray
    maximum: np.ndarray
    minimum: np.ndarray

    @property
    def peak_to_peak(self) -> np.ndarray:
        """Maximum minus minimum of every period, (k,)."""
        return np.asarray(self.maximum - self.minimum)


def peaks(signal: Signal) -> SignalPeaks:
    """Find the extremes of a signal over its whole span.

    Sampled values as they are: nothing is interpolated between them.
    """
    high, low = int(np.argmax(signal.values)), int(np.argmin(signal.values))
    return SignalPeaks(
        maximum=float(signal.values[high]),
        minimum=float(signal.values[low]),
        time_of_maximum=float(signal.time[high]),
        time_of_minimum=float(signal.time[low]),
    )


def peaks_per_period(signal: Signal, forcing_frequency: float) -> PeriodPeaks:
    """Find the extremes in every whole forcing period, counted from t = 0.

    Args:
        signal: Evenly sampled, at least two values in a period.
        forcing_frequency: f in Hz.

    Raises:
        SignalError: Not one whole period, or fewer than two values in a period.
    """
    interval, period = signal.interval, 1.0 / forcing_frequency
    if interval > 0.5 * period:
        raise SignalError(f"{signal.name}: fewer than two values in a forcing period of {period:g} s")
    index = np.floor(signal.time / period + _PHASE_SLACK).astype(int)
    margin = max(interval, 0.5 * signal.width)
    first = int(np.ceil((signal.time[0] - margin) / period - _PHASE_SLACK))
    stop = int(np.floor((signal.time[-1] + margin) / period + _PHASE_SLACK))
    if stop <= first:
        raise SignalError(f"{signal.name}: {signal.duration:g} s hold no whole forcing period of {period:g} s")
    number = np.arange(first, stop)
    parts = [signal.values[index == j] for j in number]
    return PeriodPeaks(number, np.array([part.max() for part in parts]), np.array([part.min() for part in parts]))


def record_columns(history: xr.Dataset, record: str) -> dict[str, Signal]:
    """Return the columns of a record by their labels, such as "tip y".

    The first value of records of interval means, which no interval precedes, is left out, and a last one at another
    distance in time.

    Args:
        history: History that holds the record.
        record: Its name.

    Raises:
        SignalError: Values that are not finite, or none.
    """
    variable = history[record]
    time, values = np.asarray(history["time"].values, dtype=float), variable.values.reshape(variable.shape[0], -1)
    if time.size > 2 and abs(time[-1] - 2.0 * time[-2] + time[-3]) > _UNEVEN * (time[-2] - time[-3]):
        time, values = time[:-1], values[:-1]
    if record in INTERVAL_MEANS:
        time, values = time[1:], values[1:]
    labels = product(*(map(str, variable[dim].values) for dim in variable.dims[1:]))
    return {
        " ".join(words): Signal(time, column, unit_at(history, record, words), " ".join([record, *words]))
        for words, column in zip(labels, np.asarray(values.T, dtype=float), strict=True)
    }


SHARE = 0.1
"""Share of the record that is enlarged where nothing repeats."""

LEAD = 0.1
"""Share of the enlarged part before the part where most happens, to show its onset."""


def enlarged_span(time: np.ndarray, values: np.ndarray, frequency: float | None, periods: int) -> tuple[float, float]:
    """Return the start and end of the part, s.

    Without forcing it is the tenth of the record with the largest int (x - median x)^2 dt, and a little before it: a
    shock is shown where it happens.

    Args:
        time: Time of the record, (n,), s.
        values: Measure of the activity, (n,), in any unit.
        frequency: Frequency of the forcing, Hz; None without forcing.
        periods: Number of forcing periods.
    """
    first, last = float(time[0]), float(time[-1])
    if frequency is not None:
        return last - min(last - first, periods / frequency), last
    width = SHARE * (last - first)
    power = (values - np.median(values)) ** 2
    energy = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time))])
    starts = time[time <= last - width]
    if not starts.size or not energy[-1] > 0.0:
        return last - width, last
    found = np.interp(starts + width, time, energy) - np.interp(starts, time, energy)
    start = max(first, float(starts[np.argmax(found)]) - LEAD * width)
    return start, start + width


def unit_of_time(span: tuple[float, float]) -> tuple[str, float]:
    """Return the unit of the time axis of the part, and the number of these units in a second."""
    return shown("s", abs(span[1]))


def unit_of_record(time: np.ndarray) -> tuple[str, float]:
    """Return the unit of the time axis of a whole record, s where that can be read, and the number in a second."""
    last = float(np.abs(time).max(initial=0.0))
    return ("s", 1.0) if last >= LEAST_IN_S else shown("s", last)
