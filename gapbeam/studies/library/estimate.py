"""Values of a scene estimated from recordings, and their change over a series of recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, sqrt
from typing import Any

import numpy as np
from rich.table import Table
from scipy.stats import norm

from gapbeam.postprocess.study_figures.study_axis import si_key
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, positive
from gapbeam.solver.system.operators import Array
from gapbeam.studies.library.calibrated_regression import CONFIDENCE, OUTSIDE
from gapbeam.studies.library.recording import Recording
from gapbeam.studies.library.recording_library import Library
from gapbeam.studies.printed_results import PrintedResult, table_of
from gapbeam.studies.uncertain.probability import IntervalEstimate

DOUBTFUL = 5
Z = float(norm.ppf(0.5 + CONFIDENCE / 2.0))


@dataclass(frozen=True, repr=False)
class EstimatedValues(PrintedResult):
    """Values of a scene from one recording.

    Attributes:
        name: Name of the recording.
        values: Values by path, and figures by name, with 95 % intervals; `count`: windows of the recording, of which
            features are means.
        rarity: Share of members of the library that are as far off, at most 1.
        ends: Paths whose interval comes to an end of their range: the value may lie beyond it.
        units: SI units by path, as far as they are known.
    """

    name: str
    values: dict[str, IntervalEstimate]
    rarity: float
    ends: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_outside(self) -> bool:
        """True where the recording is unlike the members of the library: its values are not to be used."""
        return self.rarity < OUTSIDE

    @property
    def exit_status(self) -> int:
        """0, or 5 where the recording lies outside of the library."""
        return DOUBTFUL if self.is_outside else 0

    def headline(self) -> str:
        """Return the estimate in one line."""
        if self.is_outside:
            return (
                f"{self.name}: outside of the library ({self.rarity:.2g} of its members are as far off): another "
                "structure, load, unit or point, more noise, or values beyond the ranges; do not use the values"
            )
        parts = [
            f"{si_key(path, self.units)} {one.value:.4g} ({one.low:.4g} to {one.high:.4g})"
            for path, one in self.values.items()
        ]
        ends = f"; at an end of the range, may lie beyond: {', '.join(self.ends)}" if self.ends else ""
        return f"{self.name}: {', '.join(parts)}{ends}"


@checked
def estimate(found: Library, recording: Recording, period: float | None = None) -> EstimatedValues:
    """Estimate the values of a scene from a recording of its motion, in milliseconds.

    Args:
        found: Result of `library` or `read_library`.
        recording: Recording of the point and quantity of the library, at least one window of its periods long.
        period: Period of the loads in the recording where a little different from the library's, s.

    Raises:
        UserError: The recording has another quantity, is too short or sampled too slowly, does not move, or its period
            is another one.
    """
    features = features_of(found, recording, period)
    u, half, rarity = found.regression(features.mean(axis=0, keepdims=True))
    low, high = (np.clip(u[0] + sign * half[0], 0.0, 1.0) for sign in (-1.0, 1.0))
    table = found.values_at(np.array([np.clip(u[0], 0.0, 1.0), low, high]))
    ends = tuple(path for path, a, b in zip(found.paths, low, high, strict=True) if a <= 0.0 or b >= 1.0)
    values = {
        path: IntervalEstimate(float(middle), float(a), float(b), len(features))
        for path, (middle, a, b) in zip(found.paths, table.T, strict=True)
    }
    return EstimatedValues(recording.name, values, float(rarity[0]), ends, found.units)


def features_of(found: Library, recording: Recording, period: float | None) -> Array:
    """Return the features of each window of a recording, (windows, features); arguments as of `estimate`."""
    if recording.quantity != found.quantity:
        raise UserError(
            f"{recording.name}: unit: found a recording of {recording.quantity}, expected {found.quantity} of the "
            f"point {found.point!r}, which the library is of"
        )
    T = found.period if period is None else float(positive(period, "estimate: period"))
    if not abs(T / found.period - 1.0) <= 0.5 / found.kind.periods:
        raise UserError(
            f"{recording.name}: period: found {T:.6g} s, but the library is for {found.period:.6g} s; "
            f"expected less than half a line of {found.kind.periods} periods between them: march a library at "
            "that frequency"
        )
    c = recording.spectra(T, found.kind.periods, found.kind.harmonics)
    if not np.all(np.abs(c).max(axis=1) > 0.0):
        raise UserError(f"{recording.name}: the values do not change; is it the right column?")
    return found.kind.of(c)


@dataclass(frozen=True)
class Trend:
    """Change of a value over a series of recordings, by weighted least squares.

    Attributes:
        rate: Per unit of the times, with its 95 % interval.
        limit: Limit that the value reaches; None: none was given.
        reached: The time at which it does, and its 95 % interval: infinite where the value need not come there.
        scatter: Root mean square of the residuals over what the intervals say: above 2, a straight line is doubtful.
    """

    rate: IntervalEstimate
    limit: float | None
    reached: IntervalEstimate | None
    scatter: float

    @property
    def is_seen(self) -> bool:
        """True where the interval of the rate leaves out 0."""
        return self.rate.low > 0.0 or self.rate.high < 0.0


@dataclass(frozen=True, repr=False)
class Series(PrintedResult):
    """Estimates of a series of recordings, and the trend of each value.

    Attributes:
        times: Times of the recordings, in a unit of the user's.
        estimates: Estimates in this order; those outside of the library are left out of trends.
        trends: Trends by path, of estimates inside the library whose interval comes to no end of the range; none of
            paths with fewer than three.
    """

    times: Array
    estimates: tuple[EstimatedValues, ...]
    trends: dict[str, Trend]

    @property
    def exit_status(self) -> int:
        """0, or 5 where a recording lies outside of the library."""
        return max(one.exit_status for one in self.estimates)

    def headline(self) -> str:
        """Return the trends in one line."""
        outside = [one.name for one in self.estimates if one.is_outside]
        words = [f"{', '.join(outside)} outside of the library"] if outside else []
        units = self.estimates[0].units
        for path in self.estimates[0].values:
            ends = [one.name for one in self.estimates if path in one.ends and not one.is_outside]
            if ends:
                words.append(f"{path} at an end of the range, may lie beyond, left out: {', '.join(ends)}")
            if path not in self.trends:
                continue
            one = self.trends[path]
            rate = f"{si_key(path, units)} {one.rate.value:+.3g} ({one.rate.low:+.3g} to {one.rate.high:+.3g})"
            rate += " each unit of time"
            words.append(rate if one.is_seen else f"{rate}: no change seen")
            if one.reached is not None:
                words.append(
                    f"at {one.limit:.4g} at time {one.reached.value:.4g} ({one.reached.low:.4g} to "
                    f"{one.reached.high:.4g})"
                )
            if one.scatter > 2.0:
                words.append(f"scatter {one.scatter:.2g} times the intervals': not a straight line")
        few = [path for path in self.estimates[0].values if path not in self.trends]
        if few:
            words.append(
                f"fewer than three recordings inside of the library and the range of {', '.join(few)}: no rates, no "
                "times to limits"
            )
        return "; ".join(words)

    def rows(self) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
        """Return heads and one row for each recording and value."""
        heads = ("time", "recording", "value", "unit", "estimate", "from", "to", "windows", "rarity", "verdict")
        rows = [
            (float(t), one.name, path, one.units.get(path, ""), x.value, x.low, x.high, x.count, one.rarity,
             "outside" if one.is_outside else "at an end" if path in one.ends else "inside")
            for t, one in zip(self.times, self.estimates, strict=True) for path, x in one.values.items()
        ]  # fmt: skip
        return heads, rows

    def tables(self) -> list[Table]:
        """Return all estimates."""
        return [table_of(*self.rows())]


@checked
def series(
    estimates: Sequence[EstimatedValues], times: Any = None, limits: Mapping[str, float] | None = None
) -> Series:  # fmt: skip
    """Follow the values of a series of recordings: rates, and the times at which limits are reached.

    v(t) = a + b t by weighted least squares, with the weights of the intervals; errors grow by the scatter of the
    residuals where that is larger. Estimates whose interval comes to an end of the range are left out: the value may
    lie beyond it. The interval of the time to a limit holds all t with abs(a + b t - limit) inside the
    error of a + b t.

    Args:
        estimates: Results of `estimate`.
        times: Times of the recordings, in any unit; default 0, 1, 2, ...
        limits: Limits by path.

    Raises:
        UserError: Times and estimates differ in number, times are all one, or a limit is of no value.

    Source: Fieller (1954), Some problems in interval estimation, J. Roy. Stat. Soc. B 16.
    """
    if not estimates:
        raise UserError("series: expected one estimate or more")
    t = finite(np.arange(len(estimates)) if times is None else times, "series: times")
    if t.shape != (len(estimates),):
        raise UserError(f"series: times: found {t.size}, expected {len(estimates)}: one for each recording")
    unknown = [path for path in limits or {} if path not in estimates[0].values]
    if unknown:
        raise UserError(f"series: limit of {unknown[0]!r}; expected one of {', '.join(estimates[0].values)}")
    inside = [i for i, one in enumerate(estimates) if not one.is_outside]
    trends = {}
    if len(inside) > 2:
        if not np.ptp(t[inside]) > 0.0:
            raise UserError("series: times: all recordings have one time; expected times that differ")
        for path in estimates[0].values:
            some = [i for i in inside if path not in estimates[i].ends]
            if len(some) > 2 and np.ptp(t[some]) > 0.0:
                trends[path] = _trend(t[some], [estimates[i].values[path] for i in some], (limits or {}).get(path))
    return Series(t, tuple(estimates), trends)


def _trend(t: Array, some: Sequence[IntervalEstimate], limit: float | None) -> Trend:
    y = np.array([one.value for one in some])
    error = np.array([(one.high - one.low) / (2.0 * Z) for one in some])
    w = 1.0 / np.maximum(error, np.finfo(float).tiny) ** 2
    middle = float((w * t).sum() / w.sum())
    square = float((w * (t - middle) ** 2).sum())
    b, a = float((w * (t - middle) * y).sum() / square), float((w * y).sum() / w.sum())
    scatter = sqrt(float((w * (y - a - b * (t - middle)) ** 2).sum()) / (len(t) - 2))
    grown = Z * max(scatter, 1.0)
    half = grown / sqrt(square)
    rate, count = IntervalEstimate(b, b - half, b + half, len(t)), len(t)
    if limit is None:
        return Trend(rate, None, None, scatter)
    d = limit - a
    when = middle + d / b if b else inf
    # (b x - d)^2 = grown^2 (1 / sum w + x^2 / square), x = t - middle
    A, B, C = b * b - half * half, -b * d, d * d - grown**2 / float(w.sum())
    root = sqrt(max(B * B - A * C, 0.0))
    first, last = -inf, inf
    if A > 0.0:
        first, last = (middle + (-B + sign * root) / A for sign in (-1.0, 1.0))
    elif A < 0.0 < C:  # the rate may be 0: from where the error first comes to the limit
        first = middle + (-B - root) / A
    return Trend(rate, limit, IntervalEstimate(when, first, last, count), scatter)
