"""Largest contact force of each face, recorded where the contact is resolved, otherwise as the largest mean.

The largest force on record means something where records resolve the contact that carries it. Elsewhere it follows the
step and the formulation and has no limit as the step shrinks. The largest mean over the contact, or over ten records of
a longer one, is an impulse over a time, which converges.

The duration of a contact is

    T = min(time with force about the peak, 2 x time with more than half of the peak about it)

where the force is a line between records, so that T does not jump where a record is half of the peak. For half a sine T
is the contact itself; of a face that stays closed while a short blow meets it, T is the blow. Records that show blows
too short for them hide others, whatever the contact of the largest force lasts.

Key figures are taken over the spans of a run, in windows of equal length; their names are those of all tables of a run.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import floor

import numpy as np

from gapbeam.postprocess.signals.figure_names import (
    AXIAL_STRESS,
    DISPLACEMENT,
    IMPULSE,
    LARGEST_FORCE,
    MEAN_FORCE,
    SMOOTHED_ACCELERATION,
    VON_MISES_STRESS,
)
from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.diagnostics.contact_episodes import RESOLVING_STEPS
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.motion_record import MotionRecord, harmonics, risen, window_means

WHOLE_RUN, SETTLED, SECOND_HALF = "whole run", "settled part", "second half"
UP_TO_HORIZON, BEYOND_HORIZON = "up to the horizon", "beyond the horizon"
PERIODS = 12  # of the forcing, in a window: whole cycles of 1, 2, 3, 4, 6 and 12 periods
FEWEST_PERIODS = 4  # in a run, or there is no settled part
FEWEST_WINDOWS = 4  # of which a standard error is taken
FEWEST, FEWEST_RECORDS = 2, 8  # records in a span: at all, and up to the horizon, where some steps say nothing
ALL = 0.999  # of the time of a run: what ends earlier is a part of it
_WHOLE = 1.0e-6
EXTREMES = {"maximum": (1.0,), "minimum": (-1.0,), "peak-to-peak": (1.0, -1.0)}
OF_OWN = 0.25  # least difference of a value or an extreme over what records usually differ by


@dataclass(frozen=True)
class Span:
    """Part of a motion, in windows of equal length.

    Attributes:
        name: "whole run", "first part", "start-up", SETTLED, SECOND_HALF, UP_TO_HORIZON or BEYOND_HORIZON.
        start: s.
        width: Width of a window, s.
        count: Number of windows.
        frequency: Frequency of the forcing, Hz, where the windows are whole periods of it; None: no harmonics.
        cut: Whether the horizon ends it.
    """

    name: str
    start: float
    width: float
    count: int
    frequency: float | None = None
    cut: bool = field(default=False, kw_only=True)

    @property
    def predictable(self) -> bool:
        """True where the span lies before the horizon."""
        return self.name != BEYOND_HORIZON

    @property
    def end(self) -> float:
        """End of the last window, s."""
        return self.start + self.count * self.width

    def windows(self, motion: MotionRecord) -> Iterator[MotionRecord]:
        """Yield the motion window by window."""
        for number in range(self.count):
            begin = self.start + number * self.width
            yield motion.between(begin, begin + self.width)


@dataclass(frozen=True)
class FigureSpan(Span):
    """Part of a run that a figure of one's own is taken over, in one window.

    Attributes:
        figure: The figure.
        number: Among those of the motion.
    """

    figure: Figure | None = None
    number: int = 0

    def value(self, motion: MotionRecord) -> dict[str, WindowFigure]:
        """Return the figure of a motion by its name; empty where the motion has none."""
        assert self.figure is not None
        found = self.figure.value(motion.times, motion.own[:, self.number]).value
        if found is None or not np.isfinite(found):
            return {}
        return {self.figure.name: WindowFigure(motion.unit(self.figure.place, self.figure.unit), np.array([found]))}

    def left_open(self, motion: MotionRecord) -> float:
        """Return the error that records leave of times, of probabilities (95 % interval) and of extremes but forces."""
        assert self.figure is not None
        found = self.figure.value(motion.times, motion.own[:, self.number])
        if None not in (found.value, found.low, found.high):
            return max(found.value - found.low, found.high - found.value)  # type: ignore[operator]
        if self.figure.quantity == "contact_force" or self.figure.statistic not in EXTREMES:
            return 0.5 * motion.interval if self.figure.statistic.startswith("time-of") else 0.0
        series = motion.between(self.start, self.end).own[:, self.number]
        return sum(risen(end * series) for end in EXTREMES[self.figure.statistic])

    def apart(self, one: MotionRecord, other: MotionRecord, usual: float) -> dict[str, float]:
        """Return the least difference of a value or an extreme of two motions, which may agree by chance: by name."""
        assert self.figure is not None
        is_value, is_force = self.figure.time is not None, self.figure.quantity == "contact_force"
        if not is_value and (is_force or self.figure.statistic not in EXTREMES):
            return {}
        begin = max(self.start, 0.5 * self.end * is_value)
        a, b = (motion.between(begin, self.end).own[:, self.number] for motion in (one, other))
        return {self.figure.name: OF_OWN * float(np.quantile(np.abs(a - b), usual))}


def spans_of(case: Case, end: float, interval: float, horizon: float | None, repeats: bool = False) -> list[Span]:
    """Return the spans of a run.

    A run under one forcing frequency, at least four periods long, has a start-up and a second half, which begins after
    the smooth start of the loads and in the middle of the run at the earliest; it is the settled part where it repeats.
    Its windows are 12 forcing periods long, or a quarter of it where it is shorter. Other runs are taken as a whole;
    where the records end before the case does, as those of slow companions, they are the first part. What lies beyond
    the horizon is a span of its own; so few windows lie there at times that its figures have no error. What lies before
    it is none where there are fewer than eight records.

    Args:
        case: The case.
        end: End of the records, s.
        interval: Interval between records, s.
        horizon: Time up to which the motion is predictable, s; None: up to the end.
        repeats: The second half is periodic: its figures can be predicted, whatever the horizon is.
    """
    return spans_between(end, case.time.end, *frequency_and_rise(case), interval, horizon, repeats)


def frequency_and_rise(case: Case) -> tuple[float | None, float]:
    """Return the frequency of the forcing, Hz, None but for a single one, and the smooth start of the loads, s."""
    frequencies = forcing_frequencies(case.load)
    rise = max((load.rise_time for load in case.load), default=0.0)
    return frequencies[0] if len(frequencies) == 1 else None, rise


def spans_between(
    end: float, last: float, frequency: float | None, rise: float, interval: float, horizon: float | None,
    repeats: bool = False,
) -> list[Span]:  # fmt: skip
    """Return the spans of a motion; see `spans_of`.

    Args:
        end: End of the records, s.
        last: End of the run, s.
        frequency: Frequency of the forcing, Hz; None: it has none, or several.
        rise: Smooth start of the loads, s.
        interval: Interval between records, s.
        horizon: Time up to which the motion is predictable, s; None: up to the end.
        repeats: The second half is periodic: its figures can be predicted, whatever the horizon is.
    """
    known = end if horizon is None else horizon
    least = FEWEST if horizon is None else FEWEST_RECORDS
    if frequency is None or end * frequency < FEWEST_PERIODS:
        everything = WHOLE_RUN if end > ALL * last - interval else "first part"
        whole = everything if horizon is None else UP_TO_HORIZON
        return [Span(whole, 0.0, known, 1, cut=horizon is not None)] if known > least * interval else []
    late = floor((end - max(rise, 0.5 * end)) * frequency + _WHOLE) or 1
    periods = min(PERIODS, max(1, late // FEWEST_WINDOWS))
    count, width = late // periods, periods / frequency
    begin = end - count * width
    spans = []
    first = min(begin, known)
    if first > (FEWEST if known >= begin else FEWEST_RECORDS) * interval:
        cut = known < begin
        spans.append(Span(UP_TO_HORIZON if cut else "start-up", 0.0, first, 1, cut=cut))
    predictable = count if repeats else max(0, min(count, floor((known - begin) / width + _WHOLE)))
    if predictable:
        name = SETTLED if repeats else SECOND_HALF
        spans.append(Span(name, begin, width, predictable, frequency, cut=predictable < count))
    if predictable < count:
        beyond = begin + predictable * width
        spans.append(Span(BEYOND_HORIZON, beyond, width, count - predictable, frequency))
    return spans


DURATION = "contact_duration"
BLOW = 0.1  # of the largest force: a contact that is not resolved and carries more may reach any force
MOST = 0.75  # of the points that touch: where more do so briefly, the face slaps
NOTABLE = 1.3  # of the mean: a larger force of one record is not a force of the structure

OF_MOTION = ""

ForcePeaks = dict[str, dict[str, dict[str, float]]]


def contact_records(force: Array) -> int:
    """Return the duration of the contact that carries the largest force, in records; 0 without contact.

    Args:
        force: Contact force of a face, (n,), N.
    """
    peak = int(np.argmax(force))
    if not force[peak] > 0.0:
        return 0

    half = 0.5 * float(force[peak])
    around = _reach(force[peak:], 0.0) + _reach(force[peak::-1], 0.0)
    return min(round(around) - 1, round(2.0 * (_reach(force[peak:], half) + _reach(force[peak::-1], half))))


def brief_share(force: Array, active: Array) -> float:
    """Return the largest share of the touching points that touch only briefly in the contact of the largest force.

    Brief is less than half of the records that resolve a contact. The points that touch longer at a time are the
    largest of the least numbers in the spans of that length around it (morphological opening).

    Args:
        force: Contact force of a face, (n,), N.
        active: Its points under pressure, (n,).
    """
    peak = int(np.argmax(force))
    if not force[peak] > 0.0:
        return 0.0
    first, last = peak - int(_reach(force[peak::-1], 0.0)) + 1, peak + int(_reach(force[peak:], 0.0))
    width = RESOLVING_STEPS // 2
    touching = active[first:last]
    if len(touching) < width:
        return 0.0
    least = np.lib.stride_tricks.sliding_window_view(touching, width).min(axis=1)
    long = np.lib.stride_tricks.sliding_window_view(np.pad(least, width - 1), width).max(axis=1)
    return float(((touching - long) / np.maximum(touching, 1.0)).max())


def lost_in_steps(motion: MotionRecord, step: float) -> dict[str, float]:
    """Return by how much the step may falsify the contact of each face, as a share of its figures.

    A midpoint or trapezoidal rule turns a half period T into one of d steps h, pi h / T = 2 tan(pi / (2 d)), longer by

        d h / T - 1 = (2 d / pi) tan(pi / (2 d)) - 1:

    27 % of a contact of two steps, 5.5 % of one of four, 0.8 % of one of ten. Twice the step shows this error only
    where contacts are resolved. A largest recorded force also lacks what `between_records` finds: a companion whose
    records lie otherwise about the peak may agree with it by chance.

    Args:
        motion: Motion of the run, over a part of it.
        step: Time step h, s.

    Returns:
        Shares by face, of its largest recorded force, and of the face with the largest impulse by OF_MOTION; a share
        by steps is at most 1, and 0 without contact.
    """
    found = dict.fromkeys((*motion.faces, OF_MOTION), 0.0)
    for number, face in motion.pressed:
        steps = contact_records(motion.force[:, number]) * motion.interval / step
        found[face] = _longer(steps) if steps > 0.0 else 0.0
        found[f"{face} {LARGEST_FORCE}"] = found[face] + between_records(
            motion.force[:, number], step / motion.interval
        )
    if motion.faces:
        strongest = int(np.argmax(motion.impulse[-1] - motion.impulse[0]))
        found[OF_MOTION] = found[motion.faces[strongest]]
    return found


def between_records(force: Array, steps: float) -> float:
    """Return the share of its largest record by which a force is larger than that, by the parabola through three.

    A step takes the mean of the depths at its ends, which is less deep than its middle: by D / 8 in the force where
    each step is a record, with D as in `risen`.

    Args:
        force: Contact force of a face, (n,), N.
        steps: Step over the interval between records.
    """
    peak = int(np.argmax(force))
    if not (0 < peak < len(force) - 1 and force[peak] > 0.0):
        return 0.0
    curved = max(2.0 * force[peak] - force[peak - 1] - force[peak + 1], 0.0)
    return float((risen(force) + steps**2 * curved / 8.0) / force[peak])


def _longer(steps: float) -> float:
    """Return by how much a contact of so many steps is longer than without a step, relative, at most 1."""
    return min(1.0, 2.0 * steps / np.pi * np.tan(0.5 * np.pi / steps) - 1.0) if steps > 1.0 else 1.0


RESOLVED = _longer(RESOLVING_STEPS)  # share that a contact of just enough steps loses


def _reach(force: Array, level: float) -> float:
    """Return after how many records a force, given from its peak on, has fallen to a level."""
    below = np.flatnonzero(force <= level)
    if not below.size:
        return float(force.size)
    place = int(below[0])
    if level == 0.0:
        return float(place)
    high, low = force[place - 1], force[place]
    return place - 1 + float((high - level) / (high - low))


def contact_windows(motion: MotionRecord) -> dict[str, float | None]:
    """Return the kind of peak force of each face: None, the largest on record, or a mean over so many s.

    Records resolve a contact of more than ten of them. A shorter one has the mean over itself. Where a longer one
    carries the largest force and blows are not resolved, ten records are the width: what a blow adds to a mean over a
    given time converges with the step.

    Args:
        motion: Motion of the run, over the part whose peaks are asked for.
    """
    found: dict[str, float | None] = {}
    for number, face in motion.pressed:
        count = contact_records(motion.force[:, number])
        resolved = count > RESOLVING_STEPS and not hides_blows(motion, number)
        found[face] = None if resolved or not count else motion.interval * min(count, RESOLVING_STEPS)
    return found


def hides_blows(motion: MotionRecord, face: int) -> bool:
    """Return whether blows on a face are shorter than records resolve, though the largest force lasts longer.

    Either a contact of at most ten records carries a tenth of the largest force, or most of the points that touch in
    the contact of the largest force do so for less than five records.

    Args:
        motion: Motion over a part of a run.
        face: Its number.
    """
    force = motion.force[:, face]
    touching = np.diff((force > 0.0).astype(int), prepend=0, append=0)
    begins, ends = np.flatnonzero(touching > 0), np.flatnonzero(touching < 0)
    whole = (begins > 0) & (ends < len(force)) & (ends - begins <= RESOLVING_STEPS)
    blows = [force[begin:end].max() for begin, end in zip(begins[whole], ends[whole], strict=True)]
    return max(blows, default=0.0) > BLOW * force.max() or _brief(motion, face) > MOST


def _brief(motion: MotionRecord, face: int) -> float:
    """Return `brief_share` of a face by its number; 0 where no points were recorded."""
    return brief_share(motion.force[:, face], motion.active[:, face]) if motion.active.size else 0.0


def peak_forces(motion: MotionRecord, windows: Sequence[float | None]) -> Array:
    """Return the largest force of each face, (faces,), N.

    Args:
        motion: The records.
        windows: Windows of each face: None for the largest on record, else the width of the mean, s.
    """
    found = [
        motion.force[:, face].max()
        if width is None
        else window_means(motion.impulse[:, face : face + 1], motion.interval, width).max()
        for face, width in enumerate(windows)
    ]
    return np.array(found, dtype=float)


def force_peaks(run: MotionRecord, spans: Iterable[Span]) -> ForcePeaks:
    """Return the largest force on record, the mean over its contact, of ten records at most, N, and its duration, s.

    Args:
        run: The motion.
        spans: Its parts.

    Returns:
        Peaks by part of the run and face: LARGEST_FORCE, MEAN_FORCE and DURATION.
    """
    found: ForcePeaks = {}
    for span in spans:
        part = run.between(span.start, span.end)
        durations = [run.interval * contact_records(part.force[:, face]) for face in range(len(run.faces))]
        widths = [min(max(one, run.interval), RESOLVING_STEPS * run.interval) for one in durations]
        largest, means = part.force.max(axis=0), peak_forces(part, widths)
        found[span.name] = {
            face: {LARGEST_FORCE: float(largest[number]), MEAN_FORCE: float(means[number]), DURATION: durations[number]}
            for number, face in run.pressed
        }
    return found


SMALLER_STEP = ", or a smaller time.step"


def doubtful_peaks(
    found: Mapping[str, Mapping[str, Mapping[str, float]]], interval: float, instead: str = SMALLER_STEP,
    turning: Collection[str] = (),
) -> Iterator[str]:  # fmt: skip
    """Yield a sentence where the largest forces belong to contacts that records do not resolve; of faces the worst.

    Args:
        found: As `force_peaks` returns them.
        interval: Interval between records, s.
        instead: Another remedy, after the use of mean forces.
        turning: Faces between rotations, whose forces are moments.
    """
    worst: dict[str, Mapping[str, float]] = {}
    for faces in found.values():
        for face, peaks in faces.items():
            short = peaks[DURATION] < (RESOLVING_STEPS + 0.5) * interval
            if short and peaks[LARGEST_FORCE] > NOTABLE * peaks[MEAN_FORCE] > 0.0:
                worst[face] = max(peaks, worst.get(face, peaks), key=lambda one: one[LARGEST_FORCE])
    if not worst:
        return
    face, peaks = max(worst.items(), key=lambda one: one[1][LARGEST_FORCE] / one[1][MEAN_FORCE])
    largest, mean, count = peaks[LARGEST_FORCE], peaks[MEAN_FORCE], round(peaks[DURATION] / interval)
    unit = unit_where("N", face in turning)
    others = f" (and so on {', '.join(one for one in worst if one != face)})" if len(worst) > 1 else ""
    yield (
        f"the {LARGEST_FORCE} on {face}{others}, {largest:.4g} {unit}, is {largest / mean:.2g} times the {MEAN_FORCE}, "
        f"{mean:.4g} {unit}: a contact of {counted(count, 'record')} is not resolved, and its {LARGEST_FORCE} "
        f"depends on the step; use the {MEAN_FORCE}{instead}"
    )


HARMONICS = 3
HARMONIC = " harmonic "


@dataclass(frozen=True)
class Averages:
    """The widths of the means in key figures, which a run and its companions share.

    Attributes:
        acceleration: Window of the smoothed acceleration, s.
        force: Window of the peak force of each face, s; None: it is the largest on record.
    """

    acceleration: float
    force: Mapping[str, float | None] = field(default_factory=dict)

    def width_of(self, name: str) -> float | None:
        """Return the width of the mean that a figure of that name is, s; None: it is none."""
        if name.endswith(f" {SMOOTHED_ACCELERATION}"):
            return self.acceleration
        return self.force.get(name.removesuffix(f" {MEAN_FORCE}")) if name.endswith(f" {MEAN_FORCE}") else None


def key_figures(motion: MotionRecord, span: Span, averages: Averages) -> dict[str, WindowFigure]:
    """Return the key figures of a motion over the windows of a span, by name.

    For each probe: peak to peak of the displacement and of the smoothed absolute acceleration, and, over whole periods
    of the forcing, the amplitudes of the first three harmonics of the displacement, of bodies that move in space for
    both directions; for each gauge the range of the axial and the largest von Mises stress; for each face the impulse,
    and the largest recorded force or the largest mean force; of a law of impulses the impulse alone.

    Args:
        motion: The records.
        span: Part of the run.
        averages: Widths of the means.
    """
    if isinstance(span, FigureSpan):
        return span.value(motion)
    found: dict[str, list[tuple[str, float]]] = {}
    for window in span.windows(motion):
        for name, unit, value in _figures(window, span.frequency, averages):
            found.setdefault(name, []).append((unit, value))
    return {name: WindowFigure(rows[0][0], np.array([value for _, value in rows])) for name, rows in found.items()}


def _figures(motion: MotionRecord, frequency: float | None, averages: Averages) -> Iterator[tuple[str, str, float]]:
    """Yield name, unit and value of each figure in one window."""
    ranges = np.ptp(motion.displacement, axis=0)
    means = window_means(motion.velocity_gained, motion.interval, averages.acceleration)
    for number, probe in enumerate(motion.probes):
        yield f"{probe} {DISPLACEMENT}", motion.unit(probe, "m"), float(ranges[number])
        if len(means) > 1:  # the part is longer than one mean
            yield f"{probe} {SMOOTHED_ACCELERATION}", motion.unit(probe, "m/s^2"), float(np.ptp(means[:, number]))
        if frequency is not None:
            amplitudes = harmonics(motion.times, motion.displacement[:, number], frequency, HARMONICS)
            for order, amplitude in enumerate(amplitudes, 1):
                yield f"{probe}{HARMONIC}{order}", motion.unit(probe, "m"), float(amplitude)
    for number, gauge in enumerate(motion.gauges):
        yield f"{gauge} {AXIAL_STRESS}", "Pa", float(np.ptp(motion.stress[:, 0, number]))
        yield f"{gauge} {VON_MISES_STRESS}", "Pa", float(motion.stress[:, 1, number].max())
    windows = [averages.force.get(face) for face in motion.faces]
    peaks = peak_forces(motion, windows)
    for number, (face, width) in enumerate(zip(motion.faces, windows, strict=True)):
        force, impulse = motion.unit(face, "N"), motion.unit(face, "N s")
        if face not in motion.impulsive:
            yield f"{face} {LARGEST_FORCE if width is None else MEAN_FORCE}", force, float(peaks[number])
        yield f"{face} {IMPULSE}", impulse, float(motion.impulse[-1, number] - motion.impulse[0, number])
