"""Places of structures in space: an origin and the directions of the structure's own axes.

x_space = origin + Q x_own,     Q = (axis, across x axis, across)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gapbeam.solver.scene.argument_checks import ArgumentError, finite
from gapbeam.solver.system.operators import Array

ALONG = 1e-6  # cosine or sine of directions that are at right angles or one
Direction = Sequence[float]


@dataclass(frozen=True)
class Pose:
    """Place of a structure in space.

    Attributes:
        origin: Where the origin of the structure is, m.
        axis: Direction in space of the structure's own x axis: the axis of a beam; of any length.
        across: Direction of its own z axis: the motion of a beam; of any length, at right angles to the axis. Default:
            z of space, made to be at right angles.

    Raises:
        ArgumentError: A vector has not three numbers, is 0, or the directions are not at right angles.
    """

    origin: Direction = (0.0, 0.0, 0.0)
    axis: Direction = (1.0, 0.0, 0.0)
    across: Direction | None = None

    def __post_init__(self) -> None:
        for name in ("origin", "axis", "across"):
            value = getattr(self, name)
            if value is None:
                continue
            given = finite(value, f"place: {name}")
            if given.shape != (3,) or (name != "origin" and not np.linalg.norm(given) > 0.0):
                kind = "" if name == "origin" else " that are not all 0"
                raise ArgumentError(f"place: found {name} {value!r}, expected three numbers{kind}", "place")
        x = _unit(self.axis)
        if self.across is None:
            if np.linalg.norm(np.cross(x, [0.0, 0.0, 1.0])) < ALONG:
                raise ArgumentError(
                    "place: found an axis along z, expected `across` with it: the direction of the own z axis", "place"
                )
        elif abs(x @ _unit(self.across)) > ALONG:
            raise ArgumentError(
                f"place: found across {list(self.across)} that is not at right angles to axis {list(self.axis)}, "
                "expected directions at right angles",
                "place",
            )

    @cached_property
    def turn(self) -> Array:
        """Q, (3, 3): columns are the own axes in space."""
        x, z = _unit(self.axis), _unit((0.0, 0.0, 1.0) if self.across is None else self.across)
        z = _unit(z - (z @ x) * x)
        return np.column_stack([x, np.cross(z, x), z])

    def in_space(self, places: Array) -> Array:
        """Return places, (..., 3), in space."""
        return np.asarray(np.asarray(self.origin, dtype=float) + places @ self.turn.T)

    def own(self, places: Array) -> Array:
        """Return places of space, (..., 3), in the structure's own axes."""
        return np.asarray((places - np.asarray(self.origin, dtype=float)) @ self.turn)


def _unit(direction: Direction | Array) -> Array:
    given = np.asarray(direction, dtype=float)
    return np.asarray(given / np.linalg.norm(given))
