"""Figures of an experiment of an identification: their names, units and words, and their values in a response.

Derivatives of the figures of an experiment by its unknowns where its response is periodic: without another run.

A response x = P(x, p) of the map P over its period moves with a parameter by

    dx/dp = (1 - P')^-1 dP/dp,

with P' from the linearized steps of the period. A march from x + d dx/dp at p + d is on its response up to d^2: a few
periods of it give the figures there, as no transient has to pass.

Source: Parker and Chua (1989), Practical Numerical Algorithms for Chaotic Systems, sec. 5.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.signals.signal import face_signal, probe_signal
from gapbeam.postprocess.signals.spectra import smooth
from gapbeam.postprocess.signals.steady_figures import WindowFigure, Windows
from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.models.model import Model
from gapbeam.solver.periodic.periodic_response import SteadyModel, steady
from gapbeam.solver.periodic.shooting import relative_change, shoot
from gapbeam.solver.seat.contact_modes import RIGID, held_modes
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State
from gapbeam.studies.identification.identification_tables import Figure, ForceFigure, FrequencyFigure, MotionFigure
from gapbeam.studies.trials.response import respond

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
        figure: Figure that is asked for.
        history: The records.
        windows: Windows after the transient.

    Raises:
        SignalError: The records are too coarse or too short for it.
    """
    if figure.window is not None:
        windows = windows.of(figure.window)
    return WindowFigure(unit_of(figure), _values(figure, history, windows))


STILL = 1.0e-3
"""Frequency of a rigid motion at most, over the one of the overhang. A clamp leaves no rigid motion, a pin one."""


def natural_frequency(figure: FrequencyFigure, model: Model) -> WindowFigure:
    """Return a natural frequency of a model.

    Raises:
        RunError: No seat was found, or the model has not so many modes.
    """
    for held in held_modes(model, figure.mode, figure.mode + RIGID):
        if held.name == figure.held:
            found = held.bending()[0]
            elastic = found[found > STILL * model.bending_frequency]
            return WindowFigure("Hz", elastic[figure.mode - 1 :][:1])
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


CONVERGED = 1e-9
"""Change of a response over its period, relative."""
ANOTHER = 0.05
"""Distance of the converged response from the end of the run, relative, beyond which it is another one."""
CYCLES = 4
"""Periods of a response that are marched for its figures; those of the last three count."""

Shifted = tuple[tuple[float, Model], tuple[float, Model]]
"""Two places of an unknown, by their distance from the present one, with their models."""


def end_of_run(model: Model, end: State) -> list[float] | None:
    """Return the state at the end of a run in modal coordinates, (2n,); None for models that are not dense."""
    modal = modal_system(model.system)
    if modal is None:
        return None
    return [float(x) for part in (end.u, end.v) for x in modal.coordinates(part[VALUE])]


def figure_slopes(
    model: Model, end: Array, cycle: int, figures: Sequence[MotionFigure | ForceFigure],
    shifted: Sequence[Shifted | None],
) -> dict[str, list[float | None]]:  # fmt: skip
    """Return derivatives of figures of a periodic response, by name, one for each unknown; None where there is none.

    Args:
        model: Model of the run.
        end: Its end, as of `end_of_run`, after a whole number of periods of the loads.
        cycle: Periods of the loads in a period of the response.
        figures: Figures of the motion.
        shifted: Models beside it, by unknown; None: of another body.

    Raises:
        NotConverged: No stable response of that period is near the end of the run, or a march beside it failed.
        SignalError: A figure cannot be taken.
    """
    analysis = Periodic(type="periodic", periods=cycle)
    held = steady(model, analysis)
    here = held.modal_map()
    if here is None:
        raise NotConverged("the model is not dense")
    orbit = shoot(here, end, CONVERGED)
    if not here.stability(orbit.monodromy).stable or relative_change(here.scale, end, orbit.x) > ANOTHER:
        raise NotConverged("the response near the end of the run is another one, or not stable")
    found: dict[str, list[float | None]] = {figure.name: [] for figure in figures}
    for pair in shifted:
        values = None if pair is None else _along(held, orbit.x, orbit.monodromy, analysis, pair, figures)
        for number, one in enumerate(found.values()):
            one.append(None if values is None else float(values[number]))
    return found


def _along(
    held: SteadyModel, x: Array, monodromy: Array, analysis: Periodic, pair: Shifted,
    figures: Sequence[MotionFigure | ForceFigure],
) -> Array | None:  # fmt: skip
    """Return derivatives of figures by one unknown; None where the number of steps of a period changes."""
    beside = [steady(model, analysis) for _, model in pair]
    maps = [one.modal_map() for one in beside]
    (low, _), (high, _) = pair
    if any(one.steps != held.steps for one in beside) or None in maps:
        return None
    ends = [one.after(x) for one in maps if one is not None]
    along = np.linalg.solve(np.eye(len(x)) - monodromy, (ends[1] - ends[0]) / (high - low))
    values = [
        _figures(one, there.state(x + far * along), figures)
        for one, there, far in zip(beside, maps, (low, high), strict=True) if there is not None
    ]  # fmt: skip
    return np.asarray((values[1] - values[0]) / (high - low))


def _figures(held: SteadyModel, start: State, figures: Sequence[MotionFigure | ForceFigure]) -> Array:
    """Return figures of a response from a state on it."""
    model = held.model
    every = steps_between_records(figures, model.step, held.case.output.history_interval)
    response = respond(model, start, CYCLES * held.steps, every * model.step)
    if response.exit_status:
        raise NotConverged(f"the march beside the response: {response.message}")
    wanted = {"time", "displacement", "velocity", *map(record_of, figures)}
    history = as_history({name: response.history[name] for name in wanted}, response.labels)
    windows = Windows(held.forcing_frequency, (CYCLES - 1) * held.periods, 1, float(history["time"].values[-1]))
    return np.array([read_figure(figure, history, windows).mean for figure in figures])
