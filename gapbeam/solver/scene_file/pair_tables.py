"""[[pair]] and [contact]: contacts between structures, with region and law.

Pairs at the nearest places of structures are found as the structures are placed, pairs of faces become a contact at
each corner; pairs that cannot be meant are refused: motions, friction, directions, and what overlaps at the start.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene import shipped_laws
from gapbeam.solver.scene.convex_region import ConvexRegion, Disc, HalfPlane, Polygon, Slot
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.scene.structure_files import PlacedPoint
from gapbeam.solver.scene.unilateral_law import Unilateral
from gapbeam.solver.scene_file.placed_bodies import PlacedBody, nearest_places
from gapbeam.solver.scene_file.structure_tables import MeshFile
from gapbeam.solver.schema.table import (
    OF_TYPE,
    MadeTable,
    Name,
    NonNegative,
    Number,
    PointName,
    Positive,
    Switch,
    Table,
)
from gapbeam.solver.system.operators import Array

Pair2 = tuple[Number, Number]
Pair3 = tuple[Number, Number, Number]
REGIONS = {
    1: 'a "slot", or a "half-plane" with normal = 1 or -1',
    2: 'a "disc", a "polygon", or a "half-plane" with a normal of 2 numbers',
    3: 'a "half-plane" with a normal of 3 numbers',
}
"""Regions for points of so many motions."""


class HalfPlaneRegion(MadeTable):
    """The side of a flat wall: normal . r <= clearance."""

    make = HalfPlane
    type: Literal["half-plane"] = Field(description="kind of region")
    clearance: Number = Field(description="distance to the wall at rest, m", examples=[1e-3])
    normal: Literal[1, -1] | Pair2 | Pair3 = Field(
        default=1, description="toward the wall: 1 or -1, or a vector for points of two or three motions, no unit"
    )


class SlotRegion(MadeTable):
    """Between two walls, for points of one motion."""

    make = Slot
    type: Literal["slot"] = Field(description="kind of region")
    clearance: Number = Field(description="total play, m", examples=[2e-4])
    center: Number = Field(default=0.0, description="middle of the slot, m")


class DiscRegion(MadeTable):
    """A round hole around a round body, for points of two motions."""

    make = Disc
    type: Literal["disc"] = Field(description="kind of region")
    clearance: Number = Field(description="radial play, m", examples=[1e-4])


class PolygonRegion(MadeTable):
    """A convex polygon, for points of two motions."""

    make = Polygon
    type: Literal["polygon"] = Field(description="kind of region")
    corners: tuple[Pair2, ...] = Field(
        min_length=3,
        max_length=15,
        description="corners, counter-clockwise, m; at most 7 with friction that sticks",
        examples=[[[-1e-4, -1e-4], [1e-4, -1e-4], [0.0, 1e-4]]],
    )


RegionOfPair = Annotated[HalfPlaneRegion | SlotRegion | DiscRegion | PolygonRegion, OF_TYPE]


class LinearLaw(MadeTable):
    """Spring and damper side by side, F = stiffness x + damping x', never negative."""

    make = shipped_laws.KelvinVoigt
    type: Literal["kelvin-voigt"] = Field(description="name of the law")
    stiffness: Positive = Field(description="N/m", examples=[1e7])
    damping: NonNegative = Field(default=0.0, description="N s/m")


class PowerLaw(MadeTable):
    """F = stiffness x^exponent (1 + chi x')."""

    make = shipped_laws.HuntCrossley
    type: Literal["hunt-crossley"] = Field(description="name of the law")
    stiffness: Positive = Field(description="N/m^exponent", examples=[1e9])
    chi: NonNegative = Field(default=0.0, description="damping, s/m")
    exponent: Number = Field(default=1.5, ge=1.0, le=10.0, description="no unit")


class CubicLaw(MadeTable):
    """F = stiffness (x + x^3 / scale^2): a bumper that stiffens."""

    make = shipped_laws.Cubic
    type: Literal["cubic"] = Field(description="name of the law")
    stiffness: Positive = Field(description="at touch, N/m", examples=[1e5])
    scale: Positive = Field(description="penetration at which the force is doubled, m", examples=[1e-3])


class ImpulseLaw(MadeTable):
    """Exact contact: impulses that let nothing approach further, with a restitution."""

    make = Unilateral
    type: Literal["unilateral"] = Field(description="name of the law")
    restitution: NonNegative = Field(
        le=1.0, description="of the points in contact, no unit; 1 keeps energy", examples=[0.5]
    )


LawOfPair = Annotated[LinearLaw | PowerLaw | CubicLaw | ImpulseLaw, OF_TYPE]


class PairContact(Table):
    """Default law and friction of pairs."""

    formulation: Literal["penalty", "nitsche", "unilateral", "augmented-lagrangian"] = Field(
        default="penalty", description="penalty: by a law; others are refused"
    )
    law: LawOfPair | None = Field(default=None, description="law of forces, a table; default none: each pair has one")
    friction: NonNegative = Field(default=0.0, description="coefficient of friction, no unit")
    sliding: NonNegative = Field(
        default=0.0, description="speed at which friction reaches 0.71 of its limit, m/s; 0: it sticks without creep"
    )


class PairTable(Table):
    """A contact of two points, of a point and the frame, or of two faces: the first relative to the second."""

    name: Name = Field(description="unique name, in results; of faces name-0, name-1, ...", examples=["gap"])
    between: tuple[PointName] | tuple[PointName, PointName] = Field(
        description="the point in the region, and the point, else the frame, that carries it; structures or faces "
        '"structure.SET" where at says so',
        examples=[["tube.tip", "bar.edge"]],
    )
    at: Literal["nearest", "faces"] | None = Field(
        default=None,
        description="nearest: structures touch at their nearest places; faces: sets of nodes, the finer mesh first, "
        "with a law per area, Pa/m^exponent and Pa s/m",
    )
    region: RegionOfPair | None = Field(
        default=None,
        description="region of the first; of structures and faces by default a half plane at their distance",
    )
    law: LawOfPair | None = Field(default=None, description="law of forces, a table; default that of [contact]")
    friction: NonNegative | None = Field(default=None, description="coefficient, no unit; default that of [contact]")
    sliding: NonNegative | None = Field(default=None, description="see [contact], m/s; default that of [contact]")
    offset: Number | Pair2 | Pair3 = Field(default=0.0, description="place in the region at rest, of each motion, m")
    interference: Switch = Field(default=False, description="whether the pair may be pressed at rest")

    def over(self, default: PairContact) -> PairTable:
        """Return the pair with law and friction of [contact] where it has none of its own."""
        missing = (name for name in ("law", "friction", "sliding") if getattr(self, name) is None)
        return self.model_copy(update={name: getattr(default, name) for name in missing})


SAME = 1e-6


def pair_faults(
    key: Key,
    pair: PairTable,
    points: Sequence[StructurePoint],
    region: ConvexRegion,
    places: Sequence[PlacedPoint | None],
) -> list[Fault]:
    """Return the faults of a pair whose points exist.

    Args:
        key: The way to its table.
        pair: The table, over [contact].
        points: Its points.
        region: Its region.
        places: Places of its points, as far as they are known.
    """
    assert pair.region is not None
    counts = [len(point.rows) for point in points]
    if set(counts) != {region.motions}:
        words = " and ".join(map(str, counts))
        return [
            Fault((*key, "region"), f'"{pair.region.type}" of {counted(region.motions, "motion")} at points of {words}',
                  "points and a region of as many motions",
                  f"{counted(region.motions, 'direction')} of the points, or {REGIONS.get(max(counts), REGIONS[3])}",
                  related=((*key, "between"),))
        ]  # fmt: skip
    if pair.friction and region.motions == 1:
        return [
            Fault(
                (*key, "friction"),
                f"{pair.friction:g} at points of one motion",
                "points of two or three motions: normal and slip",
            )
        ]
    offset = np.atleast_1d(np.asarray(pair.offset, dtype=float))
    if len(offset) not in (1, region.motions):
        return [Fault((*key, "offset"), f"{counted(len(offset), 'number')}", f"{region.motions}: one for each motion")]
    axes = [place.axes for place in places if place is not None and place.axes is not None]
    if len(axes) == 2 and (axes[0].shape != axes[1].shape or np.abs(axes[0] - axes[1]).max() > SAME):
        return [
            Fault((*key, "between"), f"directions {axes[0].tolist()} and {axes[1].tolist()}",
                  "the same directions at both points: their motions are subtracted")
        ]  # fmt: skip
    inward = _inward(pair, places)
    if inward is not None:
        return [inward_fault(key, inward)]
    depth = _depth(pair, np.broadcast_to(offset, (region.motions,)))
    if depth > 0.0 and not pair.interference:
        return [
            Fault((*key, "region"), f"structures that overlap by {depth:g} m at the start", "a place within the region",
                  "a larger clearance, or interference = true where the pair is pressed, or its seat lies within the "
                  "region", ((*key, "offset"),))
        ]  # fmt: skip
    return []


def inward_fault(key: Key, distance: float) -> Fault:
    """Return the fault of a normal that points away from the other point."""
    return Fault(
        (*key, "region", "normal"),
        f"a normal that points inward: the second point lies {-distance:g} m behind the first along it",
        "a normal from the first point toward the second",
        "the other sign, or the points in the other order",
    )


def _inward(pair: PairTable, places: Sequence[PlacedPoint | None]) -> float | None:
    """Return the distance along the normal of the second point from the first where it is below 0."""
    if len(places) < 2 or not isinstance(pair.region, HalfPlaneRegion):
        return None
    first, second = places
    if first is None or second is None or first.place is None or second.place is None or first.axes is None:
        return None
    normal = np.atleast_1d(np.asarray(pair.region.normal, dtype=float)) @ first.axes
    way = second.place - first.place
    distance = float(normal @ way / np.linalg.norm(normal))
    return distance if distance < -SAME * float(np.linalg.norm(way)) else None


def _depth(pair: PairTable, place: Array) -> float:
    """Return the depth of a place beyond the region, m; below 0 within it."""
    region = pair.region
    if isinstance(region, SlotRegion):
        return float(abs(place[0] - region.center) - 0.5 * region.clearance)
    if isinstance(region, HalfPlaneRegion):
        normal = np.atleast_1d(np.asarray(region.normal, dtype=float))
        return float(normal @ place / np.linalg.norm(normal) - region.clearance)
    if isinstance(region, PolygonRegion):
        corners = np.array(region.corners)
        edges = np.roll(corners, -1, axis=0) - corners
        outward = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
        return float((outward * (place - corners)).sum(axis=1).max())
    assert region is not None
    return float(np.linalg.norm(place) - region.clearance)


Given = dict[str, dict[str, Any]]
"""New points by structure and name: a place along a line, m, or a node with its direction."""


def at_nearest(pair: PairTable, extents: Mapping[str, PlacedBody]) -> tuple[PairTable, Given]:
    """Return a pair at named points, and these points.

    Args:
        pair: A pair of two structures at their nearest places.
        extents: Extents of the structures.

    Raises:
        UserError: There is no one pair of nearest places, or the structures do not move toward each other.
    """
    names = pair.between
    assert len(names) == 2
    found = nearest_places(extents[names[0]], extents[names[1]])
    region = pair.region or HalfPlaneRegion(type="half-plane", clearance=found.gap)
    if isinstance(region, HalfPlaneRegion):
        region = region.model_copy(update={"normal": found.normal})
    given: Given = {}
    for name, at in zip(names, (found.first, found.second), strict=True):
        node = {"node": at, "direction": tuple(found.direction)}
        given[name] = {pair.name: node if extents[name].names else at}
    between = tuple(f"{name}.{pair.name}" for name in names)
    return pair.model_copy(update={"between": between, "at": None, "region": region}), given


def nearest_faults(key: Key, pair: PairTable, placed: Mapping[str, bool]) -> Iterator[Fault]:
    """Yield the faults in the keys of a pair at nearest places; `placed`: which structures have a place."""
    if len(pair.between) == 1:
        yield Fault((*key, "between"), f'"{pair.between[0]}" alone', "two structures at their nearest places")
    for name in pair.between:
        if name not in placed:
            known = ", ".join(placed) or "none"
            yield Fault((*key, "between"), f'"{name}", which is no structure', f"two of {known}",
                        "leave at out where points are named")  # fmt: skip
        elif not placed[name]:
            yield Fault((*key, "between"), f'"{name}", of which no place is known', "structures with a place",
                        f'add place = {{ origin = [0, 0, 0] }} to "{name}", nodes to matrices')  # fmt: skip
    if isinstance(pair.region, HalfPlaneRegion) and pair.region.normal != 1:
        yield Fault((*key, "region", "normal"), f"{pair.region.normal} at nearest places",
                    "no normal: it is from the first structure toward the second", "leave normal out")  # fmt: skip


def faces_faults(key: Key, pair: PairTable, bodies: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield the faults in the keys of a pair of faces, over [contact]; `bodies`: models of the structures by name."""
    if len(pair.between) == 1:
        yield Fault((*key, "between"), f'"{pair.between[0]}" alone', "two faces")
    for place in pair.between:
        name, dot, _ = place.partition(".")
        model = bodies.get(name)
        if not dot or model is None:
            known = ", ".join(name for name, one in bodies.items() if isinstance(one, MeshFile)) or "none"
            yield Fault((*key, "between"), f'"{place}", which is no face', f'"structure.SET" of a mesh: {known}')
        elif not isinstance(model, MeshFile):
            yield Fault((*key, "between"), f'"{place}" of a model {model.type}', "a face of a model mesh",
                        "points for other models: leave at out")  # fmt: skip
    region = pair.region
    if region is not None and (not isinstance(region, HalfPlaneRegion) or region.normal != 1):
        yield Fault((*key, "region"), f'"{region.type}"', "a half plane with a clearance, whose normal is of the face")
    elif region is not None and region.clearance < 0.0 and not pair.interference:
        yield Fault((*key, "region"), f"faces that overlap by {-region.clearance:g} m at the start",
                    "a clearance from 0 on", "interference = true where they are pressed")  # fmt: skip
    if pair.offset != 0.0:
        yield Fault((*key, "offset"), f"{pair.offset} of faces", "no offset: their places are of the meshes",
                    'region = { type = "half-plane", clearance = 1e-4 }')  # fmt: skip


def meeting_faults(
    key: Key, pair: PairTable, places: Sequence[PlacedPoint | None], bodies: Sequence[PlacedBody | None]
) -> Iterator[Fault]:
    """Yield reasons for which two points cannot touch as they are placed, or their structures overlap.

    Args:
        key: The way to the table of the pair.
        pair: The table.
        places: Places of its points.
        bodies: Extents of its structures.
    """
    if len(places) < 2 or any(one is None or one.place is None for one in places) or None in bodies:
        return
    first, second = ((one.place, one.axes) for one in places if one is not None)
    extents = [body for body in bodies if body is not None]
    assert first[0] is not None
    assert second[0] is not None
    way: Array = second[0] - first[0]
    distance, longest = float(np.linalg.norm(way)), max(body.extent for body in extents)
    clearance = abs(float(getattr(pair.region, "clearance", 0.0)))
    if longest > 0.0 and distance > longest + clearance + sum(body.half for body in extents):
        yield Fault(
            (*key, "between"), f"points {distance:g} m apart, farther than their structures are long ({longest:g} m)",
            "structures that meet", "look at origin and axis of their places, and at the units of nodes",
        )  # fmt: skip
    elif isinstance(pair.region, HalfPlaneRegion) and first[1] is not None and not pair.interference:
        normal = np.atleast_1d(np.asarray(pair.region.normal, dtype=float)) @ first[1]
        normal /= np.linalg.norm(normal)
        ends = zip(extents, (first[0], second[0]), strict=True)
        halves = sum(body.half_at(body.nearest(place)[0], normal) for body, place in ends)
        ahead = float(normal @ way)
        beside = float(np.sqrt(max(distance**2 - ahead**2, 0.0)))
        deep = halves - ahead
        if ahead >= 0.0 and beside < halves and deep > SAME * halves:
            yield Fault(
                (*key, "between"), f"structures that overlap by {deep:g} m where they are placed",
                "a distance between their surfaces", "another origin, or interference = true where they are pressed",
            )  # fmt: skip
