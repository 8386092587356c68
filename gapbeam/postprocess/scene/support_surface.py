"""Surfaces of supports, gaps enlarged as the motion is, and marks of joints, masses and fluids.

A plane is a block. A support around the beam is a ring: a round bore, a profile, or flat walls that may leave it open.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.postprocess.results.columns_of_run import RunFace, RunSupport

if TYPE_CHECKING:
    import pyvista as pv
RING = 0.3  # thickness of a ring over the thickness of the beam
CORNERS = 1.3  # radius over the distance of flat walls: room for the corners between them
TURNS = np.arange(-180.0, 181.0)  # degrees


def outer_radius(met: RunFace, thickness: float, scale: float) -> float:
    """Return the outer radius of a ring, m.

    Args:
        met: The face.
        thickness: Thickness of the beam, m.
        scale: Enlarges its gaps.
    """
    widest = 0.5 * thickness + float(met.walls(scale)[1].max())
    return (CORNERS if met.flat else 1.0) * widest + RING * thickness


def inner_radii(met: RunFace, thickness: float, scale: float, turns: np.ndarray) -> np.ndarray:
    """Return the inner radii of a ring at some angles from straight down, infinite where it is open, m."""
    angles, distances = met.walls(scale)
    radii = 0.5 * thickness + distances
    if not met.flat:
        return np.asarray(np.interp(turns, angles, radii, period=360.0))
    toward = np.cos(np.radians(turns[:, None] - angles))
    return np.asarray(np.where(toward > 0.0, radii / np.where(toward > 0.0, toward, 1.0), np.inf).min(axis=1))


def ring_of(
    met: RunFace, along: tuple[float, float], middle: tuple[float, float], thickness: float, scale: float
) -> pv.PolyData:
    """Return the surface of a ring.

    Args:
        met: The face.
        along: Start and end along the beam, m.
        middle: y and z of its middle, m.
        thickness: Thickness of the beam, m.
        scale: Enlarges its gaps.
    """
    import pyvista as pv  # for solids alone

    walls = np.sort(met.angles) if met.flat else np.empty(0)
    corners = 0.5 * (walls + np.roll(walls, -1)) + 180.0 * (walls > np.roll(walls, -1))
    turns = np.union1d(TURNS, (corners + 180.0) % 360.0 - 180.0)
    outer = outer_radius(met, thickness, scale)
    inner = np.minimum(inner_radii(met, thickness, scale, turns), outer)
    directions = np.stack([np.sin(np.radians(turns)), -np.cos(np.radians(turns))], axis=1)
    rims = [np.array(middle) + radius[:, None] * directions for radius in (inner, np.full_like(inner, outer))]
    points = [np.column_stack([np.full(len(turns), x), rim]) for x in along for rim in rims]
    count, open_at = len(turns), inner >= outer
    solid = np.flatnonzero(~(open_at[:-1] & open_at[1:]))
    sheets = ((0, 1), (2, 3), (0, 2), (1, 3))  # both ends, the inside and the outside: pairs of rims
    quads = [
        np.stack(
            [one * count + solid, one * count + solid + 1, other * count + solid + 1, other * count + solid], axis=1
        )
        for one, other in sheets
    ]
    faces = np.vstack(quads)
    return pv.PolyData(np.vstack(points), np.column_stack([np.full(len(faces), 4), faces]).ravel()).clean()


Span = tuple[float, float]

_BLOCK_HEIGHT = 0.9
_BEHIND = 0.35
_BEYOND = 0.3


@dataclass(frozen=True)
class FaceBox:
    """One face of a support as a block, or as a ring around the beam.

    Attributes:
        met: The face.
        along: Start and end along the beam, m.
        bottom: Bottom of the beam there, in the bending direction, m.
        top: Top of the beam there, m.
    """

    met: RunFace
    along: Span
    bottom: float
    top: float

    @property
    def thickness(self) -> float:
        """Thickness of the beam there, m."""
        return self.top - self.bottom

    def rise(self, x: np.ndarray, scale: float) -> np.ndarray:
        """Return by how much it is drawn higher at x than in its middle, m."""
        return scale * self.met.tilt * (x - 0.5 * (self.along[0] + self.along[1]))


@dataclass(frozen=True)
class SupportBoxes:
    """Beam and supports as boxes, m.

    Attributes:
        dimension: 2 or 3; the bending direction is y or z.
        blocks: The faces of all supports.
        near: The support that is shown from near: where it begins and ends along the beam.
        clearance: Clearance of this support.
        start: x of one end of the beam.
        end: x of the other end.
        bottom: Bottom of the beam, in the bending direction.
        top: Top of the beam.
        front: Smallest y of the beam in 3D, else 0.
        back: Largest y of the beam in 3D, else 0.
    """

    dimension: int
    blocks: tuple[FaceBox, ...]
    near: Span
    clearance: float
    start: float
    end: float
    bottom: float
    top: float
    front: float
    back: float

    @property
    def thickness(self) -> float:
        """Thickness of the beam in the bending direction."""
        return self.top - self.bottom

    @property
    def middle(self) -> float:
        """Middle of the beam in the bending direction."""
        return 0.5 * (self.bottom + self.top)

    def inside(self, x: float, height: float) -> tuple[float, float, float]:
        """Return the point in the middle of the width at a place and a height in the bending direction, m."""
        return (x, height, 0.0) if self.dimension == 2 else (x, 0.5 * (self.front + self.back), height)

    @property
    def shown_near(self) -> Span:
        """The part of the beam that the picture of the support shows, m."""
        beyond = _BEYOND * (self.near[1] - self.near[0])
        return max(self.start, self.near[0] - beyond), min(self.end, self.near[1] + beyond)

    def near_blocks(self) -> tuple[FaceBox, ...]:
        """The faces of the support that is shown from near."""
        return tuple(block for block in self.blocks if block.along == self.near)

    def is_around(self, face: str) -> bool:
        """Return whether a face is a hole around the beam."""
        return any(block.met.around for block in self.blocks if block.met.face == face)

    def box(self, block: FaceBox, scale: float) -> tuple[float, float, float, float, float, float]:
        """The limits in x, y, z of a block or a ring without tilt, `scale` times the gap away from the undeformed beam.

        A point of the beam displaced by u is drawn at its place + scale u: it touches this plane where u is the gap,
        neither earlier nor later.
        """
        height = _BLOCK_HEIGHT * self.thickness
        if block.met.around:
            reach = outer_radius(block.met, block.thickness, scale)
            side, middle = scale * block.met.lateral, 0.5 * (self.bottom + self.top) + scale * block.met.offset
            return (*block.along, side - reach, side + reach, middle - reach, middle + reach)
        if block.met.below:
            plane = block.bottom - scale * block.met.gap
            low, high = plane - height, plane
        else:
            plane = block.top + scale * block.met.gap
            low, high = plane, plane + height
        first, last = block.along[0], block.along[1]
        if self.dimension == 2:
            return (first, last, low, high, 0.0, 0.0)
        return (first, last, self.front, self.back + _BEHIND * (self.back - self.front), low, high)

    def heights(self, blocks: tuple[FaceBox, ...], scale: float) -> Span:
        """The limits of blocks and beam in the bending direction, m."""
        bending = self.dimension - 1
        boxes = [self.box(block, scale)[2 * bending : 2 * bending + 2] for block in blocks]
        rises = [float(np.abs(block.rise(np.array(block.along), scale)).max()) for block in blocks]
        lows = [low - rise for (low, _), rise in zip(boxes, rises, strict=True)]
        highs = [high + rise for (_, high), rise in zip(boxes, rises, strict=True)]
        return min(self.bottom, *lows), max(self.top, *highs)


def support_of(
    points: np.ndarray, dimension: int, supports: Sequence[RunSupport], loudest: str | None = None
) -> SupportBoxes:
    """Return beam and supports in the frame of the mesh.

    Args:
        points: Points of the undeformed mesh, (points, 3), m.
        dimension: 2 or 3.
        supports: Supports of the run.
        loudest: The face whose support is shown from near; None: the first one.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    bending, first = dimension - 1, float(low[0])
    bottom, top = float(low[bending]), float(high[bending])
    blocks = tuple(
        FaceBox(met, (first + one.start, first + one.end), *_surfaces(bottom, top, one.thickness))
        for one in supports
        for met in one.faces
    )
    shown = next((one for one in supports if loudest in [met.face for met in one.faces]), supports[0])
    return SupportBoxes(
        dimension=dimension,
        blocks=blocks,
        near=(first + shown.start, first + shown.end),
        clearance=shown.clearance,
        start=first,
        end=float(high[0]),
        bottom=bottom,
        top=top,
        front=float(low[1]) if dimension == 3 else 0.0,
        back=float(high[1]) if dimension == 3 else 0.0,
    )


def _surfaces(bottom: float, top: float, thickness: float | None) -> Span:
    """Return the lowest and highest place of the beam in a support, given those of the whole beam, m."""
    if thickness is None:
        return bottom, top
    middle = 0.5 * (bottom + top)
    return middle - 0.5 * thickness, middle + 0.5 * thickness


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
        end: End of a fluid along the axis, m; None for the others.
        away: Distance of a mass beside and above the axis, m.
        ahead: Distance of a mass along the axis from the section that carries it, m.
    """

    name: str
    x: float
    symbol: str
    end: float | None = None
    away: tuple[float, float] = (0.0, 0.0)
    ahead: float = 0.0

    @property
    def moves(self) -> bool:
        """True for masses, which move with the beam; joints stay where they are, and fluids around it."""
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
        fractions: Map from points (k, 3), m, to places in the picture (k, 2).
        motion: Map from a mark and undeformed points (k, 3), m, to drawn points, (k, 3), m; None: the same points.
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
