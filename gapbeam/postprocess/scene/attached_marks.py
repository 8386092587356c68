"""Marks where joints hold the beam, masses sit on it and fluids surround it, and where they are in a picture."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.postprocess.scene.support_surface import SupportBoxes

_JOINTS = {"clamped": "s", "pinned": "^", "guided": "D", "elastic": "P"}
_MASS = "o"
ARM: dict[str, Any] = {"color": "black", "lw": 1.6, "zorder": 4}
"""Style of the line from a mass beside the axis to the section that carries it."""


@dataclass(frozen=True)
class Mark:
    """A joint, a mass or a fluid in a picture.

    Attributes:
        name: Name in the case.
        x: Place on the beam axis, or where a fluid begins, m.
        symbol: Marker of matplotlib; empty for a fluid.
        end: Where a fluid ends, m; None for the others.
        away: How far beside and above the axis a mass is, m.
        ahead: How far along the axis from the section that carries it a mass is, m.
    """

    name: str
    x: float
    symbol: str
    end: float | None = None
    away: tuple[float, float] = (0.0, 0.0)
    ahead: float = 0.0

    @property
    def moves(self) -> bool:
        """Whether the beam carries it: masses; joints stand where they are, and fluids around it."""
        return self.symbol == _MASS


@dataclass(frozen=True)
class PlacedMark:
    """A mark in a picture; places are fractions of its width and height.

    Attributes:
        mark: The mark.
        at: The place on the axis of the beam, or beside it, or in the middle of a fluid.
        above: The upper side of the beam there, or the place of a mass that is higher.
        root: The place on the axis whose section carries a mass beside it; None: it is on the axis.
        outline: Corners of the part of the picture that a fluid takes up, (4, 2); None for the others.
    """

    mark: Mark
    at: np.ndarray
    above: np.ndarray
    root: np.ndarray | None = None
    outline: np.ndarray | None = None


def placed(
    marks: Iterable[Mark],
    support: SupportBoxes,
    heights: tuple[float, float],
    fractions: Callable[[np.ndarray], np.ndarray],
    motion: Callable[[Mark, np.ndarray], np.ndarray] | None = None,
) -> Iterator[PlacedMark]:
    """Yield marks with their places.

    Args:
        marks: The marks.
        support: Beam and supports.
        heights: Limits of what the picture shows in the bending direction, m: a fluid is shaded from one to the other.
        fractions: From points (k, 3), m, to places in the picture (k, 2).
        motion: From a mark and undeformed points (k, 3), m, to where they are drawn, (k, 3), m; None: there.
    """
    for mark in marks:
        x = mark.x if mark.end is None else 0.5 * (mark.x + mark.end)
        beside, height = mark.away
        place = np.add(support.inside(x, support.middle + height), (0.0, beside, 0.0))
        root = support.inside(x - mark.ahead, support.middle)
        points = np.array([place, support.inside(x, max(support.top, support.middle + height)), root])
        at, above, root_at = fractions(points if motion is None else motion(mark, points))
        if mark.end is None:
            beside_axis = mark.away != (0.0, 0.0) or mark.ahead != 0.0
            yield PlacedMark(mark, at, above, root_at if beside_axis else None)
            continue
        corners = [(mark.x, heights[0]), (mark.end, heights[0]), (mark.end, heights[1]), (mark.x, heights[1])]
        yield PlacedMark(mark, at, above, outline=fractions(np.array([support.inside(*corner) for corner in corners])))


def carried_by(marks: Iterable[Mark], middle: float) -> list[tuple[float, float]]:
    """Return x and height of the masses, m.

    Args:
        marks: Joints, masses and fluids.
        middle: Height of the axis, m.
    """
    return [(mark.x, middle + mark.away[1]) for mark in marks if mark.moves]


def marks_of(case: Mapping[str, Any], start: float) -> Iterator[Mark]:
    """Yield the joints, masses and fluids of a case, with the x of the mesh.

    Args:
        case: The case as run.
        start: x of the mesh at the end of the beam where x is 0 in the case, m.
    """
    for joint in case.get("joint", []):
        yield Mark(str(joint["name"]), start + float(joint["point"]), _JOINTS.get(joint["type"], "s"))
    for mass in case.get("mass", []):
        along, *across = mass.get("offset") or (0.0, 0.0)
        away = (across[0] if len(across) == 2 else 0.0, across[-1])
        yield Mark(str(mass["name"]), start + float(mass["point"]) + along, _MASS, away=away, ahead=along)
    for fluid in case.get("fluid", []):
        yield Mark(str(fluid["name"]), start + float(fluid["from"]), "", start + float(fluid["to"]))
