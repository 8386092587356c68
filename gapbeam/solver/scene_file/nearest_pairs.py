"""Pairs of structures at their nearest places, and pairs that cannot be meant as the structures are placed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.scene.structure_files import PlacedPoint
from gapbeam.solver.scene_file.pair_checks import SAME
from gapbeam.solver.scene_file.pair_tables import HalfPlaneRegion, PairTable
from gapbeam.solver.scene_file.placed_bodies import PlacedBody, nearest_places
from gapbeam.solver.system.operators import Array

Given = dict[str, dict[str, Any]]
"""New points by structure and name: a place along a line, m, or a node with its direction."""


def at_nearest(pair: PairTable, extents: Mapping[str, PlacedBody]) -> tuple[PairTable, Given]:
    """Return a pair at named points, and these points.

    Args:
        pair: A pair of two structures at their nearest places.
        extents: Of the structures.

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


def meeting_faults(
    key: Key, pair: PairTable, places: Sequence[PlacedPoint | None], bodies: Sequence[PlacedBody | None]
) -> Iterator[Fault]:
    """Yield reasons for which two points cannot touch as they are placed, or their structures overlap.

    Args:
        key: The way to the table of the pair.
        pair: The table.
        places: Of its points.
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
    halves = sum(body.half for body in extents)
    if longest > 0.0 and distance > longest + clearance + halves:
        yield Fault(
            (*key, "between"), f"points {distance:g} m apart, farther than their structures are long ({longest:g} m)",
            "structures that meet", "look at origin and axis of their places, and at the units of nodes",
        )  # fmt: skip
    elif isinstance(pair.region, HalfPlaneRegion) and halves > 0.0 and first[1] is not None and not pair.interference:
        normal = np.atleast_1d(np.asarray(pair.region.normal, dtype=float)) @ first[1]
        ahead = float(normal @ way / np.linalg.norm(normal))
        beside = float(np.sqrt(max(distance**2 - ahead**2, 0.0)))
        deep = halves - ahead
        if ahead >= 0.0 and beside < halves and deep > SAME * halves:
            yield Fault(
                (*key, "between"), f"structures that overlap by {deep:g} m where they are placed",
                "a distance between their surfaces", "another origin, or interference = true where they are pressed",
            )  # fmt: skip
