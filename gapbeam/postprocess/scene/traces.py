"""Time signals next to the pictures: contact forces, and the displacement of a probe or the free end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.signals.signal import face_signal, probe_signal
from gapbeam.solver.schema.record_table import HISTORY_FILE


@dataclass(frozen=True)
class Traces:
    """Signals for the panels next to the pictures.

    Attributes:
        time: (n,), s, of the forces; empty without a history.
        forces: Contact force of each face in N, (n,) each.
        displacement_time: (k,), s.
        displacement: (k,), m, in the bending direction.
        place: Whose displacement it is.
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
