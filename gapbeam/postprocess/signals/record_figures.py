"""The figures of a response without a period: peak to peak over the whole record, and the largest forces."""

from __future__ import annotations

import numpy as np
import xarray as xr

from gapbeam.postprocess.signals.figure_names import (
    ACCELERATION,
    DISPLACEMENT,
    LARGEST_FORCE,
    SMOOTHED_ACCELERATION,
)
from gapbeam.postprocess.signals.signal import Signal, SignalError, face_signal, probe_signal
from gapbeam.postprocess.signals.smoothing import smooth_over, window_of
from gapbeam.postprocess.signals.steady_figures import WindowFigure

WORD = "no period"


def figures_of_record(history: xr.Dataset, after: float | None = None) -> tuple[dict[str, WindowFigure], list[str]]:
    """Return figures, named as in `gapbeam.postprocess.signals.steady_figures.steady`, and notes.

    For every probe, in the bending direction: peak to peak of displacement, acceleration and smoothed acceleration.
    For every face: the largest contact force on record and the impulse of all contacts ("whole impulse").

    Args:
        history: The records of a run.
        after: s, from when on; by default all.

    Raises:
        SignalError: No probe, nothing after that time, or values that are not finite.
    """
    probes = [str(name) for name in history["probe"].values] if "probe" in history.coords else []
    if not probes:
        raise SignalError("the run recorded no probe; add [[probe]] to the case")
    quantities: dict[str, WindowFigure] = {}
    notes: list[str] = []
    for probe in probes:
        acceleration = probe_signal(history, "acceleration_absolute", probe)
        quantities[f"{probe} {DISPLACEMENT}"] = _range(probe_signal(history, "displacement", probe), after)
        quantities[f"{probe} {ACCELERATION}"] = _range(acceleration, after)
        try:
            quantities[f"{probe} {SMOOTHED_ACCELERATION}"] = _range(
                smooth_over(acceleration, window_of(history, None)), after
            )
        except SignalError as fault:
            notes.append(f"not smoothed: {fault}")
    for face in (str(name) for name in history["face"].values) if "face" in history.coords else ():
        force, impulse = (_later(face_signal(history, name, face), after) for name in ("contact_force", "impulse"))
        quantities[f"{face} {LARGEST_FORCE}"] = WindowFigure("N", np.array([force.max()]))
        quantities[f"{face} whole impulse"] = WindowFigure("N s", np.array([impulse[-1] - impulse[0]]))
    return quantities, list(dict.fromkeys(notes))


def _range(signal: Signal, after: float | None) -> WindowFigure:
    return WindowFigure(signal.unit, np.array([np.ptp(_later(signal, after))]))


def _later(signal: Signal, after: float | None) -> np.ndarray:
    values = signal.values if after is None else signal.values[signal.time >= after]
    if values.size == 0:
        raise SignalError(f"{signal.name}: the record ends before the transient does")
    return values
