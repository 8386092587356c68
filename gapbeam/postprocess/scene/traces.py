"""Time signals and captions next to pictures: contact forces, a displacement; factors, clearance, time, speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gapbeam.postprocess.display_units import shown, size_words
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.signals.signal import face_signal, probe_signal
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.record_table import HISTORY_FILE


@dataclass(frozen=True)
class Traces:
    """Signals for the panels next to the pictures.

    Attributes:
        time: (n,), s, of the forces; empty without a history.
        forces: Contact force of each face in N, (n,) each.
        displacement_time: (k,), s.
        displacement: (k,), m, in the bending direction.
        place: Place that has this displacement.
    """

    time: np.ndarray
    forces: dict[str, np.ndarray]
    displacement_time: np.ndarray
    displacement: np.ndarray
    place: str

    @property
    def faces(self) -> str:
        """The faces whose forces are known, in words."""
        return " and ".join(self.forces) if len(self.forces) <= 2 else "all faces"

    def total_force(self, times: np.ndarray) -> np.ndarray | None:
        """Sum of the contact forces at some times, N; None where the forces were not recorded."""
        if not self.forces:
            return None
        return np.asarray(sum(np.interp(times, self.time, force) for force in self.forces.values()))

    def peak_force(self) -> tuple[float, float]:
        """Time, s, and size, N, of the largest recorded sum of the contact forces."""
        total = np.sum(list(self.forces.values()), axis=0)
        return float(self.time[np.argmax(total)]), float(total.max())


def loudest_face(results: Results) -> str | None:
    """Return the face with the largest contact force of a run; None where its summary does not say."""
    forces = results.summary.get("peak_contact_force") or {}
    return max(forces, key=lambda face: float(forces[face]), default=None)


def traces_of(results: Results, fields_times: np.ndarray, tip: np.ndarray) -> Traces:
    """Take the forces from the history, and the displacement of the probe nearest to the free end.

    Args:
        results: Results of the run; without a history only the displacement of the free end is there.
        fields_times: Times of the fields, (k,), s.
        tip: Displacement of the free end at these times, (k,), m; used where no probe was recorded.

    Raises:
        SignalError: A force or displacement is not finite.
    """
    empty = np.zeros(0)
    if not (results.folder / HISTORY_FILE).is_file():
        return Traces(empty, {}, fields_times, tip, "free end")
    history = results.history
    time = np.asarray(history["time"].values, dtype=float)
    forces = {}
    if "contact_force" in history:
        for face in [str(name) for name in history["face"].values]:
            forces[face] = face_signal(history, "contact_force", face).values
    if history.sizes.get("probe", 0) == 0 or "displacement" not in history:
        return Traces(time, forces, fields_times, tip, "free end")
    probe = _outermost(results)
    signal = probe_signal(history, "displacement", probe)
    return Traces(time, forces, signal.time, signal.values, probe.replace("_", " "))


def _outermost(results: Results) -> str:
    """The recorded probe with the largest x in the case; the last one where the case does not say."""
    names = [str(name) for name in results.history["probe"].values]
    places = {}
    for probe in results.case.get("probe", ()):
        point = probe.get("point")
        places[str(probe.get("name"))] = float(point[0] if isinstance(point, list) else point or 0.0)
    known = [name for name in names if name in places]
    return max(known, key=places.__getitem__) if known else names[-1]


_SLACK = 1.0e-9


@dataclass(frozen=True)
class Caption:
    """Texts of a sheet.

    Attributes:
        title: Upper left.
        whole: Factor of the picture of the whole beam.
        support: Factor and clearance of the picture of the support.
        forcing_frequency: Hz; None shows the time only.
        cadence: One line about the times shown; "" for none.
        in_unit: Unit of times, and their number in a second.
        digits: Digits behind the point of times in that unit.
    """

    title: str
    whole: str
    support: str
    forcing_frequency: float | None
    cadence: str
    in_unit: tuple[str, float] = ("ms", 1e3)
    digits: int = 2

    def clock(self, time: float) -> str:
        """Time, and forcing periods and phase since t = 0."""
        text = f"t = {self.in_unit[1] * time:.{self.digits}f} {self.in_unit[0]}"
        if self.forcing_frequency is None:
            return text
        periods = time * self.forcing_frequency + _SLACK
        return f"{text}  =  {counted(int(periods), 'forcing period')} + {360 * (periods % 1.0):.0f}°"


def caption_of(
    title: str,
    scales: tuple[float, float],
    clearance: float,
    forcing_frequency: float | None,
    times: np.ndarray,
    frames_per_second: float,
    slides: bool = False,
) -> Caption:
    """Write the texts.

    Args:
        title: Title of the case.
        scales: Factors of the pictures of the whole beam and of the support.
        clearance: m.
        forcing_frequency: Hz, or None.
        times: Times of the frames, s.
        frames_per_second: Speed of the film; 0 for no film.
        slides: Whether the beam moves along itself by so much that a picture shows that it is not enlarged.
    """
    unit, factor = shown("s", float(np.abs(times).max(initial=0.0)))
    interval = factor * float(np.median(np.diff(times))) if times.size > 1 else 0.0
    along = "; along the beam × 1" if slides else ""
    return Caption(
        title=title,
        whole=f"displacement × {scales[0]:g}, clearance × {scales[0]:g}{along}",
        support=f"displacement × {scales[1]:g}, clearance ({size_words(clearance)}) × {scales[1]:g}",
        forcing_frequency=forcing_frequency,
        cadence=_cadence(times, forcing_frequency, frames_per_second),
        in_unit=(unit, factor),
        digits=max(2, 1 - math.floor(math.log10(interval))) if interval else 2,
    )


def _cadence(times: np.ndarray, forcing_frequency: float | None, frames_per_second: float) -> str:
    if times.size < 2:
        return ""
    interval = float(np.median(np.diff(times)))
    text = f"a field every {size_words(interval, 3, 's')}"
    if forcing_frequency is not None:
        text += f", {1 / (interval * forcing_frequency):.3g} in a forcing period"
    if frames_per_second > 0.0:
        slower = 1.0 / (frames_per_second * interval)
        text += (
            f"; the film is {slower:.3g} times slower"
            if slower >= 1.0
            else f"; the film is {1 / slower:.3g} times faster"
        )
    return text
