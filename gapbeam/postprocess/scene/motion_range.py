"""Range of the motion of a beam over all times, which scales and windows follow from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gapbeam.postprocess.results.field_reader import Fields, Frame


@dataclass(frozen=True)
class MotionRange:
    """Extremes over all times.

    Attributes:
        times: (k,), s.
        tip: Mean displacement of the free end in the bending direction, (k,), m.
        lowest: Smallest displacement in the bending direction of any point, at most 0, m.
        highest: Largest, at least 0, m.
        largest_near: Largest absolute displacement in the bending direction of the points near the support,
            m.
        largest_pressure: Pa.
        strongest: Number of the frame with the largest contact pressure.
        slide: Largest mean displacement along the beam, m.
        largest_stress: Largest size of each stress that the run wrote, by name, Pa.
    """

    times: np.ndarray
    tip: np.ndarray
    lowest: float
    highest: float
    largest_near: float
    largest_pressure: float
    strongest: int
    slide: float = 0.0
    largest_stress: Mapping[str, float] = field(default_factory=dict)


def slide_of(frame: Frame) -> float:
    """Return the mean displacement along the beam, m: drawn as large as it is, or the beam would leave its supports."""
    return float(frame.displacement[:, 0].mean())


def shown_displacement(frame: Frame, scale: float) -> np.ndarray:
    """Return displacements that are drawn times a scale, m, (n, 3): the mean along the beam as large as it is."""
    return np.asarray(frame.displacement - [(1.0 - 1.0 / scale) * slide_of(frame), 0.0, 0.0])


def motion_of(fields: Fields, near: tuple[float, float]) -> MotionRange:
    """Go through all frames once.

    Args:
        fields: At least one frame.
        near: Limits of x within which points count as near the support, m.
    """
    x, bending = fields.points[:, 0], fields.dimension - 1
    end, close = x > x.max() - 1e-6 * np.ptp(x), (x >= near[0]) & (x <= near[1])
    rows, stress = [], dict[str, float]()
    for frame in fields:
        moved = frame.displacement[:, bending]
        for name, values in frame.stress.items():
            stress[name] = max(stress.get(name, 0.0), float(np.abs(values).max()))
        rows.append(
            (
                frame.time,
                moved[end].mean(),
                moved.min(),
                moved.max(),
                np.abs(moved[close]).max(),
                frame.contact_pressure.max(),
                abs(slide_of(frame)),
            )
        )
    times, tip, low, high, near_support, pressure, slide = np.array(rows, dtype=float).T
    return MotionRange(
        times=times,
        tip=tip,
        lowest=min(0.0, float(low.min())),
        highest=max(0.0, float(high.max())),
        largest_near=float(near_support.max()),
        largest_pressure=float(pressure.max()),
        strongest=int(np.argmax(pressure)),
        slide=float(slide.max()),
        largest_stress=stress,
    )
