"""Motion as error estimates read it: displacements, velocity gained, impulses, at evenly spaced times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import ceil

import numpy as np
import scipy

from gapbeam.postprocess.signals.figure_names import DISPLACEMENT, SMOOTHED_ACCELERATION
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.system.operators import Array

FINER = 4  # records of a spline
OF_PARABOLA = 1.1
STRESSES = ("axial_stress", "von_mises_stress")


@dataclass(frozen=True)
class MotionRecord:
    """The motion of a run, or of a companion of it, on the same times.

    Attributes:
        times: Times of the records, evenly spaced from t = 0, (n,), s.
        probes: Names of the probes, in space followed by the same with "lateral".
        displacement: Displacement in the bending direction, and of lateral ones across it, (n, probes), m.
        velocity_gained: Absolute acceleration integrated over time, (n, probes), m/s.
        faces: Names of the contact faces.
        force: Normal contact force, (n, faces), N.
        impulse: Contact force integrated over time, (n, faces), N s.
        in_space: Whether the second half of the probes is the lateral motion of the first.
        gauges: Names of the probes whose stress is recorded.
        stress: Axial and von Mises stress, (n, 2, gauges), Pa.
        active: Contact points under pressure, (n, faces); without columns where that was not recorded.
        closings: Number of closings of each face so far, (n, faces); without columns where that was not recorded.
        farthest: Largest displacement of a probe along any axis, or penetration, m; None: that of `displacement`.
        figures: Figures of one's own.
        own: Quantities of those figures, (n, figures), SI; not a number where the motion has no such record.
        impulsive: Faces whose law is impulses: they have no force, whose peak depends on the step.
        turning: Probes that are rotations, rad, and faces between them, whose forces are moments.
    """

    times: Array
    probes: tuple[str, ...]
    displacement: Array
    velocity_gained: Array
    faces: tuple[str, ...]
    force: Array
    impulse: Array
    in_space: bool = False
    gauges: tuple[str, ...] = ()
    stress: Array = field(default_factory=lambda: np.zeros((0, 2, 0)))
    active: Array = field(default_factory=lambda: np.zeros((0, 0)))
    closings: Array = field(default_factory=lambda: np.zeros((0, 0)))
    farthest: float | None = None
    figures: tuple[Figure, ...] = ()
    own: Array = field(default_factory=lambda: np.zeros((0, 0)))
    impulsive: tuple[str, ...] = ()
    turning: tuple[str, ...] = ()

    def unit(self, place: str | None, unit: str) -> str:
        """Return the unit of a probe or face for one of displacements and forces: it may be a rotation or a moment."""
        return unit_where(unit, place in self.turning)

    @property
    def pressed(self) -> tuple[tuple[int, str], ...]:
        """Number and name of each face that has a force."""
        return tuple((number, face) for number, face in enumerate(self.faces) if face not in self.impulsive)

    @classmethod
    def of_records(
        cls, records: Mapping[str, Array], labels: Mapping[str, Sequence[str]], in_space: bool = False,
        figures: Sequence[Figure] = (),
    ) -> MotionRecord:  # fmt: skip
        """Return the motion in the records of a run, up to the last whole interval.

        Args:
            records: Records by name, (times, ...), and "time".
            labels: Names along their dimensions.
            in_space: Whether the motion across the bending plane counts, too.
            figures: Figures of one's own.
        """
        times = np.asarray(records["time"], dtype=float)
        even = len(times)
        if even > 2 and abs((times[-1] - times[-2]) - (times[1] - times[0])) > 1.0e-6 * times[1]:
            even -= 1  # the end of a run is recorded whatever its interval
        probes = tuple(labels.get("probe", ()))
        count, still = len(times), np.zeros((len(times), 0))
        displacement: Array = still
        gained: Array = still
        farthest = None
        if probes:
            steps = np.diff(times, prepend=times[0])[:, None]
            axes = (-1, -2) if in_space else (-1,)
            displacement, acceleration = (
                np.concatenate([records[name][:, :, axis] for axis in axes], axis=1)
                for name in ("displacement", _acceleration_in(records))
            )
            pressed = float(np.max(records.get("penetration", still), initial=0.0))  # below 0: a gap
            farthest = max(float(np.abs(records["displacement"]).max(initial=0.0)), pressed)
            gained = np.cumsum(acceleration * steps, axis=0)
            probes = (*probes, *(f"{name} lateral" for name in probes)) if in_space else probes
        force = impulse = still
        faces = tuple(labels.get("face", ()))
        if faces:
            force, impulse = (records[name].reshape(count, -1) for name in ("contact_force", "impulse"))
        gauges = tuple(labels.get("gauge", ()))
        stress = np.stack([records[name] for name in STRESSES], axis=1) if gauges else np.zeros((count, 2, 0))
        active, closings = (
            np.asarray(records.get(name, still), dtype=float).reshape(count, -1)
            for name in ("active_points", "closings")
        )
        return cls(
            times[:even], probes, displacement[:even], gained[:even], faces, force[:even], impulse[:even], in_space,
            gauges, stress[:even], active[:even], closings[:even],
            farthest, tuple(figures), _own(records, labels, figures)[:even],
        )  # fmt: skip

    @property
    def ranges(self) -> Array:
        """Range of each displacement, (probes,), m."""
        return np.asarray(np.ptp(self.displacement, axis=0))

    @property
    def spans(self) -> Array:
        """Range of each displacement, (probes,), m; in space the larger one of both directions."""
        return np.tile(self.ranges.reshape(2, -1).max(axis=0), 2) if self.in_space else self.ranges

    @property
    def interval(self) -> float:
        """Time between records, s."""
        return float(self.times[1] - self.times[0])

    @property
    def end(self) -> float:
        """Time of the last record, s."""
        return float(self.times[-1])

    @property
    def contact_changes(self) -> bool:
        """True where contact points close or open; a motion in which none does is linear."""
        closed = self.active if self.active.size else self.force > 0.0
        return bool(np.any(closed[1:] != closed[:-1]))

    def between(self, start: float, end: float) -> MotionRecord:
        """Return the records from one time to another, s."""
        first, last = (round(time / self.interval) for time in (start, end))
        return self._records(slice(first, last + 1))

    def first(self, count: int) -> MotionRecord:
        """Return so many records from the first one on."""
        return self._records(slice(None, count))

    def thinned(self, factor: int) -> MotionRecord:
        """Return the first of every so many records; velocities gained and impulses add up between them."""
        return self if factor == 1 else self._records(slice(None, None, factor))

    def _records(self, part: slice) -> MotionRecord:
        series = ("times", "displacement", "velocity_gained", "force", "impulse", "stress", "active", "closings", "own")
        return replace(self, **{name: getattr(self, name)[part] for name in series})


def _own(records: Mapping[str, Array], labels: Mapping[str, Sequence[str]], figures: Sequence[Figure]) -> Array:
    """Return the quantity of each figure, (n, figures)."""
    found = np.full((len(records["time"]), len(figures)), np.nan)
    for number, figure in enumerate(figures):
        if figure.quantity in records:
            with suppress(UserError):  # a companion in the plane has no motion across it
                found[:, number] = figure.series({figure.quantity: records[figure.quantity]}, labels)
    return found


def impact_rates(run: MotionRecord, companions: Iterable[MotionRecord]) -> dict[str, tuple[float, float]]:
    """Return the least and the largest number of impacts a second, by face, among a run and its companions.

    No companion says how far a number of impacts is off: light touches come and go with step and mesh.
    """
    every = [run, *companions]
    if not all(one.closings.size for one in every):
        return {}
    rates = np.array([(one.closings[-1] - one.closings[0]) / (one.end - float(one.times[0])) for one in every])
    ranges = zip(rates.min(axis=0).tolist(), rates.max(axis=0).tolist(), strict=True)
    return dict(zip(run.faces, ranges, strict=True))


def _acceleration_in(records: Mapping[str, Array]) -> str:
    """Return the record of accelerations: relative ones where nothing says how the frame moves."""
    return "acceleration_absolute" if "acceleration_absolute" in records else "acceleration_relative"


def _window(interval: float, width: float, count: int) -> tuple[float, int]:
    """Return the width of a window in intervals, and the whole number of them that holds it."""
    wide = min(max(1.0, round(width / interval, 6)), count - 1)
    return wide, ceil(wide)


def window_means(integral: Array, interval: float, width: float) -> Array:
    """Return the means of a quantity over every window of a width, from its integral over time.

    Args:
        integral: (n, columns), evenly spaced; linear in between.
        interval: Time between its values, s.
        width: Width of the window, s; at least one interval.

    Returns:
        (windows, columns), which begin at the values; a single one over all where the record is shorter than a window.
    """
    wide, steps = _window(interval, width, len(integral))
    ends = integral[steps:] + (steps - wide) * (integral[steps - 1 : -1] - integral[steps:])
    return np.asarray((ends - integral[:-steps]) / (wide * interval))


def risen(values: Array) -> float:
    """Return the height by which the parabola through the three values about the largest one, b, rises above it.

    With a, b, c and D = 2 b - a - c that is (c - a)^2 / (8 D), and a tenth more for motions that are no parabolas.

    Args:
        values: (n,), evenly spaced.
    """
    peak = int(np.argmax(values))
    if not 0 < peak < len(values) - 1:
        return 0.0
    a, b, c = values[peak - 1 : peak + 2]
    curved = 2.0 * b - a - c
    return float(OF_PARABOLA * (c - a) ** 2 / (8.0 * curved)) if curved > 0.0 else 0.0


def risen_to_kink(values: Array) -> float:
    """Return the height at which lines through pairs of values on both sides of the largest one meet above it.

    An impulse turns a motion between records, a jump of friction or contact the mean of an acceleration: `risen` finds
    a quarter of what records miss there, or less.

    Args:
        values: (n,), evenly spaced.
    """
    peak, found = int(np.argmax(values)), 0.0
    if not 2 <= peak < len(values) - 2:
        return risen(values)
    for side in (1, -1):
        back, top, next_one, later = values[peak - side], values[peak], values[peak + side], values[peak + 2 * side]
        rise, fall = top - back, next_one - later
        if rise + fall > 0.0:
            found = max(found, rise * min(max((next_one - top + fall) / (rise + fall), 0.0), 1.0))
    return float(OF_PARABOLA * found)


def lost_between_records(motion: MotionRecord, width: float) -> dict[str, float]:
    """Return the parts of ranges, of displacements and of means of accelerations, that lie between records.

    Both ends of a range rise by parabolas, or to kinks: those of means, and of displacements where a contact is of
    impulses. A window ends a share r of an interval after a record, between which the velocity is taken as a line:
    a mean misses up to r (1 - r) of the larger second difference of the velocity at its ends, where a kink lies
    between.

    Args:
        motion: The motion, or a window of it.
        width: Width of the means, s.

    Returns:
        Losses by the name of the figure.
    """
    found = dict[str, float]()
    wide, steps = _window(motion.interval, width, len(motion.times))
    means = window_means(motion.velocity_gained, motion.interval, width)
    share = (steps - wide) * (1.0 - steps + wide) / (wide * motion.interval)
    rises = risen_to_kink if motion.impulsive else risen
    for number, probe in enumerate(motion.probes):
        u, a = motion.displacement[:, number], means[:, number]
        found[f"{probe} {DISPLACEMENT}"] = rises(u) + rises(-u)
        curved = np.pad(np.abs(np.diff(motion.velocity_gained[:, number], 2)), 1)
        ends = np.maximum(curved[1:], curved[:-1])[[np.argmax(a) + steps - 1, np.argmin(a) + steps - 1]]
        found[f"{probe} {SMOOTHED_ACCELERATION}"] = risen_to_kink(a) + risen_to_kink(-a) + share * float(ends.sum())
    return found


def harmonics(times: Array, values: Array, frequency: float, highest: int) -> Array:
    """Return the amplitudes of the first harmonics over whole periods, by Simpson's rule on a spline.

    The sum of the records alone is exact for what repeats in whole records, and off by (w h)^2 / 12 of all else.

    Args:
        times: Times of the records, evenly spaced, (n,), s.
        values: (n,).
        frequency: Hz.
        highest: Number of harmonics.
    """
    periods = max(1, round((times[-1] - times[0]) * frequency))
    turns = np.linspace(0.0, periods, FINER * (len(times) - 1) + 1)
    x = scipy.interpolate.CubicSpline(times, values)(times[0] + turns / frequency)
    waves = np.exp(-2j * np.pi * turns[:, None] * np.arange(1, highest + 1))
    return np.asarray(2.0 / periods * np.abs(scipy.integrate.simpson(x[:, None] * waves, x=turns, axis=0)))
