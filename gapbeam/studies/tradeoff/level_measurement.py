"""Cost and figures of a fidelity level, measured in a process of its own."""

from __future__ import annotations

import contextlib
import resource
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.records_in_memory import as_history
from gapbeam.postprocess.signals.signal import Signal, SignalError, probe_signal
from gapbeam.postprocess.signals.spectra import CYCLE, smooth_over, window_of
from gapbeam.postprocess.signals.steady_figures import WindowFigure, figures_over, steady
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.errors import CaseError, RunError
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.models.model import Model
from gapbeam.solver.record_table import SMOOTHING_WINDOW
from gapbeam.solver.system.semi_discrete import State
from gapbeam.studies.trials.response import VERDICTS, TrialResponse, respond
from gapbeam.studies.trials.starts import KeptBody, kicked, seated

WARM_UP = 20  # steps that are not timed: code is loaded and memory touched
KEPT = ("displacement", "velocity", "acceleration_absolute", "contact_force", "impulse")
_SAME = 1e-6


class LevelJob(NamedTuple):
    """Job that measures a level.

    Attributes:
        case: Path of the case file.
        changes: Keys to replace.
        periods: Forcing periods from the start that are followed.
        cycles: Forcing periods of the long marches after which figures are taken; 0: no long march.
        transient: Forcing periods that a long march passes before.
        starts: Long marches: from the seat, and from kicks.
        seed: Of the kicks.
        span: Time from the start over which figures are taken in windows, s; 0: only those of the periods.
    """

    case: Path
    changes: Mapping[str, Any]
    periods: int
    cycles: int = 0
    transient: int = 0
    starts: int = 1
    seed: int = 0
    span: float = 0.0


@dataclass
class MeasuredLevel:
    """Cost and answers of a fidelity level.

    Attributes:
        verdict: "passed", or what went wrong.
        message: The error, where there was one.
        dofs: DOFs that are marched.
        mesh_dofs: DOFs of the mesh.
        step: s.
        set_up: Wall time before the march, s.
        per_second: Wall time of a simulated second, s.
        memory: Largest resident memory of the process up to then, bytes.
        residual: Residual of the energy balance relative to the energy exchanged.
        frequency: Of the forcing, Hz.
        records: Of the motion from the seat over the periods followed, as in `response.TrialResponse`.
        labels: Names along their labeled dimensions.
        span: Time from the seat that `windows` cover, s; 0 without them.
        windows: Figures from the seat on, window by window as in `windows_over`, by name.
        smoothing: Window of the smoothed acceleration, s.
        words: Kind of response of every long march.
        long: Figures of the windows of all long marches together, by name.
    """

    verdict: str = "passed"
    message: str = ""
    dofs: int = 0
    mesh_dofs: int = 0
    step: float = 0.0
    set_up: float = 0.0
    per_second: float = 0.0
    memory: int = 0
    residual: float = 0.0
    frequency: float = 0.0
    records: dict[str, np.ndarray] = field(default_factory=dict)
    labels: dict[str, tuple[str, ...]] = field(default_factory=dict)
    span: float = 0.0
    smoothing: float = 0.0
    windows: dict[str, np.ndarray] = field(default_factory=dict)
    words: list[str] = field(default_factory=list)
    long: dict[str, WindowFigure] = field(default_factory=dict)

    def figures(self, periods: int) -> dict[str, float]:
        """The figures of the first forcing periods, by name as in `steady_figures.steady`."""
        quantities, _, _ = figures_over(self._history(periods), self.frequency, periods)
        return {name: one.mean for name, one in quantities.items()}

    def waves(self, periods: int) -> dict[str, Signal]:
        """Displacement and smoothed acceleration of the probes over the first forcing periods."""
        history, found = self._history(periods), dict[str, Signal]()
        window = window_of(history, self.frequency)
        for probe in self.labels["probe"]:
            acceleration = probe_signal(history, "acceleration_absolute", probe)
            found[f"{probe} displacement"] = probe_signal(history, "displacement", probe)
            with contextlib.suppress(SignalError):  # recorded too seldom
                found[f"{probe} smoothed acceleration"] = smooth_over(acceleration, window)
        return found

    def _history(self, periods: int) -> xr.Dataset:
        records = _up_to(self.records, periods / self.frequency, self.frequency)
        return as_history(records, self.labels).assign_attrs({SMOOTHING_WINDOW: self.smoothing})


def windows_over(history: xr.Dataset, frequency: float, span: float) -> dict[str, np.ndarray]:
    """Return the figures of a record, window by window, by name as in `steady_figures.steady`.

    The first window begins where the record does, the others follow each other up to its end. A window holds 12 forcing
    periods, or all those of a shorter record; the first two overlap where the record is not a whole number of windows.

    Args:
        history: The records, up to the last one within the span.
        frequency: Of the forcing, Hz.
        span: s, at least one forcing period. It decides how many windows there are: the same for all steps.
    """
    times = np.asarray(history["time"].values)
    periods = max(1, int(span * frequency + _SAME))
    width = min(CYCLE, periods)
    begin = np.flatnonzero(times <= times[0] + (width + _SAME) / frequency)
    first, _, _ = figures_over(history.isel(time=begin), frequency, width)
    later, _, _ = figures_over(history, frequency, width, periods // width)
    return {name: np.concatenate([first[name].values, one.values]) for name, one in later.items()}


def measure(jobs: Sequence[LevelJob]) -> list[MeasuredLevel]:
    """Measure fidelity levels in turn; those of one body set it up once, and its time counts for each of them."""
    kept = KeptBody()
    return [_measure(job, kept) for job in jobs]


def _measure(job: LevelJob, kept: KeptBody) -> MeasuredLevel:
    """Measure a fidelity level; a failure becomes its result."""
    found = MeasuredLevel()
    try:
        case = read_case(job.case, job.changes)
        model = kept.model(case)
        clock = time.perf_counter()
        seat = seated(model).state
        found.set_up = kept.seconds + time.perf_counter() - clock
        respond(model, seat, WARM_UP)
        found.dofs, found.mesh_dofs, found.step = model.dofs, model.mesh_dofs, model.step
        _follow(job, model, seat, found)
        if job.cycles and found.verdict == "passed":
            _settle(job, model, seat, found)
    except CaseError as error:
        found.verdict, found.message = "refused", str(error)
    except RunError as error:
        found.verdict, found.message = VERDICTS.get(type(error), "failed"), str(error)
    except SignalError as error:
        found.verdict, found.message = "failed", str(error)
    found.memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return found


def _up_to(records: Mapping[str, np.ndarray], end: float, frequency: float) -> dict[str, np.ndarray]:
    """Return records up to a time, s, within a millionth of a forcing period."""
    inside = records["time"] <= end + _SAME / frequency
    return {name: values[inside] for name, values in records.items()}


def _march(model: Model, start: State, seconds: float, found: MeasuredLevel) -> TrialResponse:
    interval = model.case.output.history_interval or model.step
    interval = max(interval, model.step)
    steps = ceil(seconds / model.step - _SAME)
    response = respond(model, start, steps, interval)
    if response.verdict != "passed":
        found.verdict, found.message = response.verdict, response.message
    return response


def _follow(job: LevelJob, model: Model, seat: State, found: MeasuredLevel) -> None:
    """Follow the motion from the seat, over the forcing periods and over the span."""
    (frequency,) = forcing_frequencies(model.case.load)
    followed = job.periods / frequency
    response = _march(model, seat, max(followed, job.span), found)
    found.per_second = response.seconds / (response.steps * model.step)
    found.residual = response.residual
    if found.verdict != "passed":
        return
    found.frequency, found.labels = frequency, response.labels
    found.smoothing, _ = smoothing_window(model.case)
    records = {name: response.history[name] for name in ("time", *KEPT)}
    found.records = _up_to(records, followed, frequency)
    if job.span > 0.0:
        found.span = job.span
        history = as_history(_up_to(records, job.span, frequency), found.labels)
        history = history.assign_attrs({SMOOTHING_WINDOW: found.smoothing})
        found.windows = windows_over(history, frequency, job.span)


def _settle(job: LevelJob, model: Model, seat: State, found: MeasuredLevel) -> None:
    """March for long from every start, and take figures over windows after the transient."""
    (frequency,) = forcing_frequencies(model.case.load)
    pooled: dict[str, list[np.ndarray]] = {}
    units: dict[str, str] = {}
    for number in range(job.starts):
        start = seat if number == 0 else kicked(model, number, job.seed).state
        response = _march(model, start, (job.transient + job.cycles) / frequency, found)
        if response.verdict != "passed":
            return
        history = as_history(response.history, response.labels).assign_attrs({SMOOTHING_WINDOW: found.smoothing})
        settled = steady(history, frequency, start.time + job.transient / frequency)
        found.words.append(settled.word)
        for name, one in settled.quantities.items():
            pooled.setdefault(name, []).append(one.values)
            units[name] = one.unit
    found.long = {name: WindowFigure(units[name], np.concatenate(values)) for name, values in pooled.items()}
