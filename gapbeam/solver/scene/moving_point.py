"""Points that move along a structure, such as a wheel on a bridge: forces and contacts at a place s(t).

Between points along the way the row b(s) of the place s is a cubic spline of their rows b_i,

    b(s) = sum_i N_i(s) b_i,     N_i(s_j) = 1 for i = j, else 0,

of order 4 in the distance of the points where the structure is smooth; 0 before the first and beyond the last, where a
contact is with the frame. A contact at such a point has the place r(t) = b(s(t)) u - ..., so a mass that presses on the
structure there carries all that a moving mass does: its weight, its inertia as the structure bends under it, the forces
by the speed along the bent way, and lifting off. Source of the equations: Fryba (1999), Vibration of Solids and
Structures under Moving Loads, 3rd ed., ch. 8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import answered, checked, finite
from gapbeam.solver.scene.scene_load import Force, Load, Value
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True, eq=False)
class Track:
    """Points along the way of a moving point, and where it is.

    Attributes:
        points: Points along the way, all of one structure.
        places: Places of the points along the way, m, growing.
        position: s, m, a function of time.
        shapes: N, a spline.
    """

    points: tuple[StructurePoint, ...]
    places: Array
    position: Callable[[Any], Array]
    shapes: Callable[[Array], Array]

    def weights(self, times: Any) -> Array:
        """Return N_i at the places of some times, (times, points); 0 outside of the way."""
        at = self.position(np.atleast_1d(np.asarray(times, dtype=float)))
        first, last = self.places[0], self.places[-1]
        inside = (first <= at) & (at <= last)
        return np.asarray(inside[..., None] * self.shapes(np.clip(at, first, last)))


def track_of(
    points: Sequence[StructurePoint], places: Sequence[float], position: float | Callable[..., Any], where: str
) -> Track:
    """Return the way of a point; arguments as of `moving_point`.

    Raises:
        UserError: Points and places do not fit.
    """
    s = finite(places, f"{where}: places")
    wrong = next((one for one in points if not isinstance(one, StructurePoint)), None)
    if wrong is not None or s.shape != (len(points),) or len(s) < 2 or not np.all(np.diff(s) > 0.0):
        raise UserError(
            f"{where}: found {counted(len(points), 'point')} and places {s.tolist()}, expected two "
            "points of structures or more, and a place for each that is beyond the one before"
        )
    speed = 0.0 if callable(position) else float(finite(position, f"{where}: position"))
    given: Callable[..., Any] = position if callable(position) else lambda t: speed * t

    def moved(times: Any) -> Array:
        asked = [(t, f"{where}: its position at {t:.6g} s") for t in np.ravel(times).tolist()]
        return np.array([finite(answered(given, t, (1,), one), one)[0] for t, one in asked])

    return Track(tuple(points), s, moved, scipy.interpolate.make_interp_spline(s, np.eye(len(s)), k=min(3, len(s) - 1)))


@dataclass(frozen=True, eq=False)
class MovingPoint(StructurePoint):
    """A point that moves along a structure; `rows` are those at t = 0.

    Attributes:
        track: Its way.
    """

    track: Track = field(kw_only=True)

    @property
    def is_moving(self) -> bool:
        """True."""
        return True


@checked
def moving_point(
    points: Sequence[StructurePoint],
    places: Sequence[float],
    position: float | Callable[..., Any],
    name: str = "",
) -> MovingPoint:
    """Return a point that moves along a structure, for contacts: a wheel on a bridge, a support along a beam.

    A scene with such contacts is marched by the midpoint rule, one member at a time.

    Args:
        points: Points of the structure along the way, two or more, with as many motions each.
        places: Places of the points along the way, m, growing.
        position: Place on the way, m, a function of time; or a speed, m/s, at which it starts from 0.
        name: Name in messages.

    Raises:
        UserError: Points and places do not fit, or points are of several structures.
    """
    where = f"moving point {name or '?'}"
    track = track_of(points, places, position, where)
    bodies, motions = {one.structure for one in points}, {len(one.rows) for one in points}
    if len(bodies) > 1 or len(motions) > 1:
        raise UserError(f"{where}: found points of several structures or numbers of motions, expected one of each")
    rows = np.tensordot(track.weights(0.0)[0], np.stack([one.rows for one in points]), 1)
    return MovingPoint(points[0].structure, rows, name, track=track)


@checked
def moving_force(
    points: Sequence[StructurePoint],
    places: Sequence[float],
    force: Value,
    position: float | Callable[..., Any],
    name: str = "",
    direction: ArrayLike | None = None,
) -> list[Force]:
    """Return the loads of a force that moves along a structure, such as a wheel on a beam: those of a scene.

    f(t) = F(t) b(s(t)); see the module.

    Args:
        points: Points along its way, two or more.
        places: Places of the points along the way, m, growing.
        force: F, N; see `Load`.
        position: s, m, a function of time; or a speed, m/s, at which it starts from 0.
        name: "wheel" makes loads "wheel-0", "wheel-1", ...
        direction: Direction in the motions of the points; default their first motion.

    Raises:
        UserError: Points and places do not fit.
    """
    track = track_of(points, places, position, f"moving force {name or '?'}")
    given = Load(points[0].structure, points[0].rows[0], force, name)

    def share(i: int) -> Callable[[Any], Any]:
        def value(t: Any) -> Any:
            times = np.ravel(np.asarray(t, dtype=float))
            return np.reshape(given.table(times)[:, 0] * track.weights(times)[:, i], np.shape(t))

        return value

    return [Force(one, share(i), direction, name=f"{name}-{i}" if name else "") for i, one in enumerate(points)]
