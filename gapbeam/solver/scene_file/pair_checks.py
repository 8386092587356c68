"""Checks of one pair besides its points: motions, friction, directions, and that nothing overlaps at the start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.scene.convex_region import ConvexRegion
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.scene.structure_files import PlacedPoint
from gapbeam.solver.scene_file.pair_tables import HalfPlaneRegion, PairContact, PairTable, PolygonRegion, SlotRegion
from gapbeam.solver.system.operators import Array

SAME = 1e-6


def pair_faults(
    key: Key,
    pair: PairTable,
    default: PairContact,
    points: Sequence[StructurePoint],
    region: ConvexRegion,
    places: Sequence[PlacedPoint | None],
) -> list[Fault]:
    """Return the faults of a pair whose points exist.

    Args:
        key: The way to its table.
        pair: The table.
        default: [contact].
        points: Its points.
        region: Its region.
        places: Where its points are, as far as it is known.
    """
    assert pair.region is not None
    counts = [len(point.rows) for point in points]
    if set(counts) != {region.motions}:
        words = " and ".join(map(str, counts))
        return [
            Fault((*key, "region"), f'"{pair.region.type}" of {region.motions} motions at points of {words}',
                  "points and a region of as many motions", related=((*key, "between"),))
        ]  # fmt: skip
    friction = default.friction if pair.friction is None else pair.friction
    if friction and region.motions == 1:
        return [
            Fault((*key, "friction"), f"{friction:g} at points of one motion", "points of two motions: normal and slip")
        ]
    offset = np.atleast_1d(np.asarray(pair.offset, dtype=float))
    if len(offset) not in (1, region.motions):
        return [Fault((*key, "offset"), f"{len(offset)} numbers", f"{region.motions}: one for each motion")]
    axes = [place.axes for place in places if place is not None and place.axes is not None]
    if len(axes) == 2 and np.abs(axes[0] - axes[1]).max() > SAME:
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
                  "a larger clearance, or interference = true where the pair is pressed", ((*key, "offset"),))
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
