"""The key figures of a motion, over windows of equal length; their names are those of all tables of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from gapbeam.postprocess.signals.figure_names import (
    AXIAL_STRESS,
    DISPLACEMENT,
    LARGEST_FORCE,
    MEAN_FORCE,
    SMOOTHED_ACCELERATION,
    VON_MISES_STRESS,
)
from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.force_peaks import peak_forces
from gapbeam.studies.error_estimate.motion_record import MotionRecord, window_means
from gapbeam.studies.error_estimate.spans import Span

HARMONICS = 3
HARMONIC = " harmonic "


@dataclass(frozen=True)
class Averages:
    """The widths of the means in key figures, which a run and its companions share.

    Attributes:
        acceleration: Of the smoothed acceleration, s.
        force: Of the peak force of each face, s; None: it is the largest on record.
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
    and the largest recorded force or the mean force over the contact.

    Args:
        motion: The records.
        span: Part of the run.
        averages: Widths of the means.
    """
    found: dict[str, list[tuple[str, float]]] = {}
    for window in span.windows(motion):
        for name, unit, value in _figures(window, span.frequency, averages):
            found.setdefault(name, []).append((unit, value))
    return {name: WindowFigure(rows[0][0], np.array([value for _, value in rows])) for name, rows in found.items()}


def _figures(motion: MotionRecord, frequency: float | None, averages: Averages) -> Iterator[tuple[str, str, float]]:
    """Yield name, unit and value of each figure in one window."""
    ranges = np.ptp(motion.displacement, axis=0)
    gains = np.ptp(window_means(motion.velocity_gained, motion.interval, averages.acceleration), axis=0)
    for number, probe in enumerate(motion.probes):
        yield f"{probe} {DISPLACEMENT}", "m", float(ranges[number])
        yield f"{probe} {SMOOTHED_ACCELERATION}", "m/s^2", float(gains[number])
        if frequency is not None:
            amplitudes = _harmonics(motion.times, motion.displacement[:, number], frequency)
            for order, amplitude in enumerate(amplitudes, 1):
                yield f"{probe}{HARMONIC}{order}", "m", float(amplitude)
    for number, gauge in enumerate(motion.gauges):
        yield f"{gauge} {AXIAL_STRESS}", "Pa", float(np.ptp(motion.stress[:, 0, number]))
        yield f"{gauge} {VON_MISES_STRESS}", "Pa", float(motion.stress[:, 1, number].max())
    windows = [averages.force.get(face) for face in motion.faces]
    peaks = peak_forces(motion, windows)
    for number, (face, width) in enumerate(zip(motion.faces, windows, strict=True)):
        yield f"{face} {LARGEST_FORCE if width is None else MEAN_FORCE}", "N", float(peaks[number])
        yield f"{face} impulse", "N s", float(motion.impulse[-1, number] - motion.impulse[0, number])


def _harmonics(times: Array, values: Array, frequency: float) -> Array:
    """Return the amplitudes of the first harmonics over whole periods, by the trapezoidal rule."""
    orders = np.arange(1, HARMONICS + 1)
    waves = np.exp(-2j * np.pi * frequency * times[:, None] * orders)
    products = values[:, None] * waves
    mean = 0.5 * (products[1:] + products[:-1]).mean(axis=0)
    return np.asarray(2.0 * np.abs(mean))
