"""The records of a response that leaves no files: motion of the probes, contact forces, impulses."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from solver.model import Model
from solver.operators import Array
from solver.output.records import COMPONENTS
from solver.output.rows import frame_mean


class MotionRecords:
    """Collects states, and turns them into the records of a history.

    Args:
        model: The model.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._kept: dict[str, list[Array]] = {name: [] for name in ("time", "u", "v", "force", "impulse")}

    @property
    def labels(self) -> dict[str, tuple[str, ...]]:
        """Names along the labeled dimensions."""
        return {
            "probe": tuple(self._model.probes),
            "component": COMPONENTS[self._model.case.mesh.dimension],
            "face": self._model.system.contact.face_names,
        }

    def add(self, times: Array, u: Array, v: Array, force: Array, impulse: Array) -> None:
        """Take in states.

        Args:
            times: (k,), s.
            u: Displacements of the probes, (k, probes, components), m.
            v: Their velocities, m/s.
            force: Contact force of each face, (k, faces), N.
            impulse: Contact force integrated over time, (k, faces), N s.
        """
        for name, values in zip(self._kept, (times, u, v, force, impulse), strict=True):
            self._kept[name].append(values)

    def history(self) -> dict[str, Array]:
        """The records by name, as in `solver.output.records.HISTORY`; empty where none were taken."""
        if not self._kept["time"]:
            return {}
        time, u, v, force, impulse = (np.concatenate(values) for values in self._kept.values())
        relative = np.zeros_like(v)
        relative[1:] = np.diff(v, axis=0) / np.diff(time)[:, None, None]
        moved = np.zeros((len(time), u.shape[2]))
        for load in self._model.system.loads:
            if load.frame_direction is not None:
                means = [frame_mean(load, *span) for span in pairwise(time)]
                moved[1:] += np.array(means).reshape(-1, 3)[:, : u.shape[2]]
        return {
            "time": time,
            "displacement": u,
            "velocity": v,
            "acceleration_relative": relative,
            "acceleration_absolute": relative + moved[:, None, :],
            "contact_force": force,
            "impulse": impulse,
        }
