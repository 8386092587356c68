"""Figures of an experiment of an identification: their names, units and words, and their values in a response."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr

from gapbeam.postprocess.signals.signal import face_signal, probe_signal
from gapbeam.postprocess.signals.spectra import smooth
from gapbeam.postprocess.signals.steady_figures import WindowFigure, Windows
from gapbeam.solver.models.model import Model
from gapbeam.solver.seat.contact_modes import FREE, RIGID, held_modes
from gapbeam.studies.identification.identification_tables import Figure, ForceFigure, FrequencyFigure, MotionFigure

WHOLE = 1.0e-6


def record_of(figure: MotionFigure | ForceFigure) -> str:
    """Return the name of the record that a figure is taken of."""
    if isinstance(figure, ForceFigure):
        return "impulse" if figure.statistic == "impulse" else "contact_force"
    return f"acceleration_{figure.frame}" if figure.quantity == "acceleration" else figure.quantity


def unit_of(figure: Figure) -> str:
    """Return the SI unit of a figure, Hz for frequencies."""
    if isinstance(figure, FrequencyFigure):
        return "Hz"
    if isinstance(figure, ForceFigure):
        return "N s" if figure.statistic == "impulse" else "N"
    return {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}[figure.quantity]


def words_of(figure: Figure) -> str:
    """Return the definition of a figure, in words."""
    if isinstance(figure, FrequencyFigure):
        return f"natural frequency of bending mode {figure.mode}, {figure.held}"
    if isinstance(figure, ForceFigure):
        statistic = "impulse in a period" if figure.statistic == "impulse" else "largest contact force"
        return f"{statistic} at the {figure.face}"
    frame = f" {figure.frame}" if figure.quantity == "acceleration" else ""
    statistic = f"harmonic {figure.order}" if figure.statistic == "harmonic" else figure.statistic.replace("-", " ")
    mean = figure.average
    averaged = f", mean over {mean.points} points at {mean.rate:g} Hz" if mean is not None else ""
    return f"{statistic} of the{frame} {figure.quantity} at {figure.probe}{averaged}"


def steps_between_records(figures: Iterable[MotionFigure | ForceFigure], step: float, interval: float | None) -> int:
    """Return the largest number of steps between records that the figures allow.

    A mean over whole sampling intervals is exact from the velocities at their ends, whatever lies between, and the
    impulse is a running total; everything else is taken from the records of the case as they are.

    Args:
        figures: Figures of the response.
        step: Time step, s.
        interval: `output.history_interval` of the case.
    """
    usual = 1 if interval is None else max(1, round(interval / step))
    found = []
    for figure in figures:
        averaged = isinstance(figure, MotionFigure) and figure.quantity == "acceleration" and figure.average is not None
        if not averaged:
            return usual
        assert isinstance(figure, MotionFigure)
        assert figure.average is not None
        exact = 1.0 / (figure.average.rate * step)
        if exact < 1.0 or abs(exact - round(exact)) > WHOLE * exact:
            return usual
        found.append(round(exact))
    return math.gcd(*found) if found else usual


def read_figure(figure: MotionFigure | ForceFigure, history: xr.Dataset, windows: Windows) -> WindowFigure:
    """Return a figure of a response, window by window.

    Args:
        figure: Which.
        history: The records.
        windows: After the transient.

    Raises:
        SignalError: The records are too coarse or too short for it.
    """
    if figure.window is not None:
        windows = windows.of(figure.window)
    return WindowFigure(unit_of(figure), _values(figure, history, windows))


def natural_frequency(figure: FrequencyFigure, model: Model) -> WindowFigure:
    """Return a natural frequency of a model.

    Raises:
        RunError: No seat was found, or the model has not so many modes.
    """
    rigid = RIGID if figure.held == FREE else 0
    for held in held_modes(model, figure.mode):
        if held.name == figure.held:
            return WindowFigure("Hz", held.bending()[0][rigid + figure.mode - 1 :][:1])
    raise AssertionError(figure.held)


def _values(figure: MotionFigure | ForceFigure, history: xr.Dataset, windows: Windows) -> np.ndarray:
    if isinstance(figure, ForceFigure):
        signal = face_signal(history, record_of(figure), figure.face)
        return windows.increments(signal) if figure.statistic == "impulse" else windows.largest(signal)
    signal = probe_signal(history, record_of(figure), figure.probe, figure.component)
    if figure.average is not None:
        signal = smooth(signal, figure.average.rate, figure.average.points)
    match figure.statistic:
        case "peak-to-peak":
            return windows.ranges(signal)
        case "maximum":
            return windows.largest(signal)
        case "minimum":
            return windows.smallest(signal)
        case "rms":
            return windows.deviations(signal)
        case "harmonic":
            return np.asarray(np.abs(windows.harmonics(signal, figure.order)[:, figure.order - 1]))
