"""The supports of a run, as its results describe them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr


class RunFace(NamedTuple):
    """A face of a support.

    Attributes:
        face: Its name.
        below: Whether it is a plane below the beam.
        gap: Distance from the undeformed beam, or from the beam in the middle of a hole, m.
        around: Whether it is a hole around the beam.
        offset: Height of the middle of a hole above the axis of the beam, m.
        lateral: Distance from that axis toward +y, m.
        tilt: By how much the face rises along the beam, no unit.
        angles: Directions in which `recesses` hold, degrees from straight down, positive toward +y; none: all alike.
        recesses: Distance of the wall beyond the gap there, m.
        flat: Whether it is made of flat walls in these directions, and not of a curve through them.
        moves: By how much gap, offset and lateral change with a unit of each of the `wall_motions`, by name.
    """

    face: str
    below: bool
    gap: float
    around: bool = False
    offset: float = 0.0
    lateral: float = 0.0
    tilt: float = 0.0
    angles: tuple[float, ...] = ()
    recesses: tuple[float, ...] = ()
    flat: bool = False
    moves: tuple[tuple[str, tuple[float, float, float]], ...] = ()

    def moved(self, motions: Mapping[str, float]) -> RunFace:
        """Return the face where motions of walls have brought it.

        Args:
            motions: Those of walls by name, m.
        """
        gap, offset, lateral = self.gap, self.offset, self.lateral
        for name, change in self.moves:
            by = motions.get(name, 0.0)
            gap, offset, lateral = gap + by * change[0], offset + by * change[1], lateral + by * change[2]
        return self._replace(gap=gap, offset=offset, lateral=lateral)

    def walls(self, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Return directions and distances of planes around the axis of the beam that bound its motion.

        Args:
            scale: Enlarges the distances.

        Returns:
            Angles, degrees, and distances from the middle of the hole, m; of a curve, at every degree.
        """
        if self.flat:
            return np.array(self.angles), scale * (self.gap + np.array(self.recesses))
        turns = np.arange(-180.0, 180.0)
        recess = np.interp(turns, self.angles, self.recesses, period=360.0) if self.angles else np.zeros(len(turns))
        return turns, scale * (self.gap + recess)


class RunSupport(NamedTuple):
    """A support.

    Attributes:
        name: Name in the case.
        start: Where it begins along the beam, m.
        end: Where it ends, m.
        clearance: m.
        faces: Faces that the beam touches.
        thickness: Thickness of the beam there, m; None: the same all along the beam.
    """

    name: str
    start: float
    end: float
    clearance: float
    faces: tuple[RunFace, ...]
    thickness: float | None = None


def supports_of(summary: Mapping[str, Any], case: Mapping[str, Any]) -> tuple[RunSupport, ...]:
    """Return the supports of a run in their order along the beam.

    Args:
        summary: The summary of the run; runs of earlier versions do not describe their supports there.
        case: The case as run, whose table [support] stands in for it.
    """
    described = (summary.get("model") or {}).get("supports")
    if described is None:
        table = case.get("support") or {}
        clearance = float(table.get("clearance", 0.0))
        faces = (RunFace("base", True, 0.0), RunFace("gland", False, clearance))
        return (RunSupport("support", 0.0, float(table.get("length", 0.0)), clearance, faces),)
    return tuple(
        RunSupport(
            str(one["name"]),
            float(one["from"]),
            float(one["to"]),
            float(one["clearance"]),
            tuple(map(_face, one["faces"])),
            float(one["thickness"]) if "thickness" in one else None,
        )
        for one in described
    )


def _face(described: Mapping[str, Any]) -> RunFace:
    side = described["side"]
    offset, lateral, tilt = (float(described.get(key, 0.0)) for key in ("offset", "lateral", "tilt"))
    angles, recesses = (tuple(map(float, described.get(key, ()))) for key in ("angles", "recesses"))
    found = (described.get("moves") or {}).items()
    moves = tuple((str(name), (float(gap), float(up), float(aside))) for name, (gap, up, aside) in found)
    return RunFace(
        str(described["name"]), side == "below", float(described["gap"]), side == "around",
        offset, lateral, tilt, angles, recesses, bool(described.get("flat")), moves,
    )  # fmt: skip


def wall_motion_series(history: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the motions of walls at the records, (times,), m, by name.

    Loads move walls under their names, the bodies of supports under NAME.AXIS.
    """
    found = dict[str, np.ndarray]()
    if "wall_motion" in history:
        moved = history["wall_motion"]
        found |= {str(name): moved.sel(moving=name).values for name in moved["moving"].values}
    if "support_displacement" in history:
        bodies = history["support_displacement"]
        for name in bodies["support_body"].values:
            for axis in bodies["support_axis"].values:
                found[f"{name}.{axis}"] = bodies.sel(support_body=name, support_axis=axis).values
    return found


def wall_motions(history: xr.Dataset, time: float) -> dict[str, float]:
    """Return the motions of walls at a time, linear between records, m, by name."""
    times = history["time"].values
    return {name: float(np.interp(time, times, moved)) for name, moved in wall_motion_series(history).items()}
