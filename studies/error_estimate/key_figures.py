"""The key figures of a motion, over windows of equal length.

Force peaks are means over 0.5 ms, differences of the impulse: the largest force of a single step follows the step and
the formulation of contact, and has no limit that a smaller step would reach.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.motion_record import MotionRecord, window_means

FORCE_WINDOW = 0.5e-3  # s
ACCELERATION_WINDOW = 2.5e-3  # s: that of the smoothed acceleration of Li et al. (2013), section 4.2
HARMONICS = 3
UP_TO_HORIZON, BEYOND_HORIZON = "up to the horizon", "beyond the horizon"


@dataclass(frozen=True)
class Span:
    """Part of a motion, in windows of equal length.

    Attributes:
        name: "whole run", "first part", "start-up", "settled part", UP_TO_HORIZON or BEYOND_HORIZON.
        start: s.
        width: Of a window, s.
        count: Number of windows.
        frequency: Of the forcing, Hz, where the windows are whole periods of it; None: no harmonics.
    """

    name: str
    start: float
    width: float
    count: int
    frequency: float | None = None

    @property
    def predictable(self) -> bool:
        """Whether it lies before the horizon."""
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
class KeyFigure(WindowFigure):
    """One figure, window by window.

    Attributes:
        group: Figures of one group are judged relative to the largest of the group; "" stands for itself.
    """

    group: str = ""


def key_figures(motion: MotionRecord, span: Span) -> dict[str, KeyFigure]:
    """Return the key figures of a motion over the windows of a span, by name.

    For each probe: peak to peak of the displacement and of the 2.5 ms mean of the absolute acceleration, and, over
    whole periods of the forcing, the amplitudes of the first three harmonics of the displacement, of bodies that move
    in space for both directions; for each gauge the range of the axial and the largest von Mises stress; for each face
    the largest 0.5 ms mean of the contact force and the impulse.
    """
    found: dict[str, list[tuple[str, str, float]]] = {}
    for window in span.windows(motion):
        for name, unit, group, value in _figures(window, span.frequency):
            found.setdefault(name, []).append((unit, group, value))
    return {
        name: KeyFigure(rows[0][0], np.array([value for _, _, value in rows]), group=rows[0][1])
        for name, rows in found.items()
    }


def peak_forces(motion: MotionRecord) -> Array:
    """Return the largest 0.5 ms mean of the contact force on each face, N."""
    return np.asarray(window_means(motion.impulse, motion.interval, FORCE_WINDOW).max(axis=0))


def _figures(motion: MotionRecord, frequency: float | None) -> Iterator[tuple[str, str, str, float]]:
    """Yield name, unit, group and value of each figure in one window."""
    ranges = np.ptp(motion.displacement, axis=0)
    gains = np.ptp(window_means(motion.velocity_gained, motion.interval, ACCELERATION_WINDOW), axis=0)
    for number, probe in enumerate(motion.probes):
        of = probe.removesuffix(" lateral") if motion.in_space else ""  # both directions are judged together
        yield f"{probe} displacement", "m", of and f"{of} displacements", float(ranges[number])
        yield f"{probe} smoothed acceleration", "m/s^2", of and f"{of} accelerations", float(gains[number])
        if frequency is not None:
            amplitudes = _harmonics(motion.times, motion.displacement[:, number], frequency)
            for order, amplitude in enumerate(amplitudes, 1):
                yield f"{probe} harmonic {order}", "m", f"{of or probe} harmonics", float(amplitude)
    for number, gauge in enumerate(motion.gauges):
        yield f"{gauge} axial stress", "Pa", "stresses", float(np.ptp(motion.stress[:, 0, number]))
        yield f"{gauge} von Mises stress", "Pa", "stresses", float(motion.stress[:, 1, number].max())
    peaks = peak_forces(motion)
    for number, face in enumerate(motion.faces):
        yield f"{face} peak force", "N", "peak forces", float(peaks[number])
        yield f"{face} impulse", "N s", "impulses", float(motion.impulse[-1, number] - motion.impulse[0, number])


def _harmonics(times: Array, values: Array, frequency: float) -> Array:
    """Return the amplitudes of the first harmonics over whole periods, by the trapezoidal rule."""
    orders = np.arange(1, HARMONICS + 1)
    waves = np.exp(-2j * np.pi * frequency * times[:, None] * orders)
    products = values[:, None] * waves
    mean = 0.5 * (products[1:] + products[:-1]).mean(axis=0)
    return np.asarray(2.0 * np.abs(mean))
