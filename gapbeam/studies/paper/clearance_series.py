"""The beam of the experiment at several clearances: its acceleration as recorded and as the paper smooths it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.records_in_memory import as_history
from gapbeam.postprocess.signals.period_windows import Windows, settled_windows
from gapbeam.postprocess.signals.periodicity import Periodicity
from gapbeam.postprocess.signals.signal import Signal, probe_signal
from gapbeam.postprocess.signals.smoothing import RATE, smooth
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.errors import RunError
from gapbeam.solver.record_table import STANDARD_GRAVITY as G
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.paper.printed_figures import printed
from gapbeam.studies.sweep.sweep_point import span
from gapbeam.studies.trials.kept_body import KeptBody
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated

SAMPLING = 1.0e-4  # s, between records
HARMONICS = 8
WANTED = ("time", "displacement", "velocity", "acceleration_absolute", "contact_force")
BODY = KeptBody()  # of this process


@dataclass(frozen=True)
class ClearanceResponse:
    """A steady response at one clearance.

    Attributes:
        clearance: m.
        history: Records of displacement, velocity, acceleration and contact force.
        cycle: Of the motion.
        windows: After the transient.
    """

    clearance: float
    history: xr.Dataset
    cycle: Periodicity
    windows: Windows

    @property
    def raw(self) -> Signal:
        """The absolute acceleration at the test point as recorded, m/s^2."""
        return probe_signal(self.history, "acceleration_absolute")

    def smoothed(self, rate: float = RATE) -> Signal:
        """The same, averaged over five samples at a rate in Hz."""
        return smooth(self.raw, rate)

    def peak_to_peak(self, signal: Signal) -> float:
        """Return the mean over the windows of the peak to peak of a signal, in g."""
        return float(np.mean(self.windows.ranges(signal))) / G

    @cached_property
    def smoothed_peak_to_peak(self) -> float:
        """What Table 4 holds: peak to peak of five points at the default rate, in g, the mean over the windows."""
        return self.peak_to_peak(self.smoothed())

    def extremes(self, signal: Signal) -> tuple[float, float]:
        """Return the lowest and the highest value of a signal about its mean, in g, means over the windows."""
        steady = signal.since(self.windows.start)
        middle = float(steady.values.mean())
        lowest, highest = self.windows.smallest(signal), self.windows.largest(signal)
        return (float(np.mean(lowest)) - middle) / G, (float(np.mean(highest)) - middle) / G

    def harmonics(self) -> np.ndarray:
        """Return the amplitudes of the harmonics 1 to 8 of the smoothed acceleration, in g, means over the windows."""
        return np.asarray(np.mean(np.abs(self.windows.harmonics(self.smoothed(), HARMONICS)), axis=0) / G)

    @property
    def word(self) -> str:
        """The kind of response in words."""
        return "no cycle" if self.cycle.period is None else f"period {self.cycle.period}"


@dataclass(frozen=True)
class _Job:
    case: Path
    settings: Mapping[str, object]


def motions(case: Path, clearances: Sequence[float], settings: Mapping[str, object]) -> list[ClearanceResponse]:
    """March the case of the experiment at several clearances from its seat, side by side.

    Args:
        case: The case file.
        clearances: m.
        settings: What differs from the case file, by key.

    Raises:
        RunError: One of them did not pass.
    """
    jobs = [_Job(case, {**settings, "support.clearance": float(value)}) for value in clearances]
    with Engine(points=len(jobs)) as engine:
        found = dict(engine.done(_march, jobs))
    return [_motion(value, found[place]) for place, value in enumerate(clearances)]


def _march(job: _Job) -> xr.Dataset:
    case = read_case(job.case, dict(job.settings))
    model = BODY.model(case)
    steps, _ = span(model)
    response = respond(model, seated(model).state, steps, case.output.history_interval)
    if response.exit_status:
        raise RunError(f"clearance {case.layout.clearance:g} m: {response.message}")
    return as_history({name: response.history[name] for name in WANTED}, response.labels)


def _motion(clearance: float, history: xr.Dataset) -> ClearanceResponse:
    cycle, windows, _ = settled_windows(history, printed()["beam"]["frequency"])
    return ClearanceResponse(clearance, history, cycle, windows)
