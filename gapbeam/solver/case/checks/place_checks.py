"""Contradictions in the loads and probes of a case: their points, directions and names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from operator import itemgetter
from types import MappingProxyType
from typing import Protocol

from gapbeam.meshes.beam_geometry import CLOSEST, SNAP
from gapbeam.solver.case.beam_profile import beam_at
from gapbeam.solver.case.case import Beam, Mesh, Probe
from gapbeam.solver.case.segment_table import Segment
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland
from gapbeam.solver.table import Vector
from gapbeam.solver.wording.short_words import apart

Loads = Mapping[int, Load]
"""Loads by their number in the case file, from 0, without those that have faults of their own."""
Probes = Mapping[int, Probe]
Segments = Mapping[int, Segment]
"""Segments by their number in the case file, from 0, without those that have faults of their own."""


def loads_lie_in_the_beam(beam: Beam, segment: Segments, mesh: Mesh, load: Loads) -> Iterator[Fault]:
    """Forces act at points of the beam."""
    for number, entry in load.items():
        if (point := entry.place.point) is not None:
            yield from outside(("load", number, "point"), point, beam, mesh, segment)
        for x in entry.extent or ():
            yield from outside(("load", number, "span"), x, beam, mesh, segment)


def probes_lie_in_the_beam(beam: Beam, segment: Segments, mesh: Mesh, probe: Probes) -> Iterator[Fault]:
    """Probes look at points of the beam."""
    for number, entry in probe.items():
        yield from outside(("probe", number, "point"), entry.point, beam, mesh, segment)


def outside(
    key: Key, point: float | Vector, beam: Beam, mesh: Mesh, segment: Segments = MappingProxyType({})
) -> list[Fault]:
    """Return the faults of a point off the beam, whose axis is y = 0 in 2D and y = z = 0 in 3D."""
    x = point[0] if isinstance(point, tuple) else point
    # where two segments meet, a point of either one is in the beam
    near = [beam_at(beam, segment.values(), x + side * SNAP * beam.thickness) for side in (-1.0, 1.0)]
    return min((list(_outside(key, point, here, mesh)) for here in near), key=len)


def _outside(key: Key, point: float | Vector, beam: Beam, mesh: Mesh) -> Iterator[Fault]:
    coordinates = point if isinstance(point, tuple) else (point,)
    if len(coordinates) not in (1, mesh.dimension):
        names = ("x", "y", "z")[: mesh.dimension]
        yield Fault(
            key,
            f"{len(coordinates)} coordinates",
            f"x alone, or [{', '.join(names)}] in {mesh.dimension}D",
            f"point = {coordinates[0]:g} for a point on the axis",
            (("mesh", "dimension"),),
        )
        return
    limits = [("x", "length", 0.0, beam.length)]
    # A mesh file may lie elsewhere across the axis than the meshes that are built here.
    if mesh.file is None:
        sides = ("thickness",) if mesh.dimension == 2 else ("width", "thickness")
        limits += [
            (x, side, -getattr(beam, side) / 2, getattr(beam, side) / 2) for x, side in zip("yz", sides, strict=False)
        ]
    for value, (name, side, least, most) in zip(coordinates, limits, strict=False):
        margin = 1e-9 * beam.length
        if least - margin <= value <= most + margin:
            continue
        hint = "coordinates are in m"
        if name != "x":
            hint = f"{name} = 0 is the axis of the beam, not its face; {hint}"
        elif least < value / 1000 <= most:
            hint = f"is it in mm? In m it is {value / 1000:g}"
        here, limit = apart(value, least if value < least else most)
        low, high = (limit, f"{most:g}") if value < least else (f"{least:g}", limit)
        found, expected = f"{name} = {here} m, outside the beam", f"{name} from {low} to {high} m"
        yield Fault(key, found, expected, hint, (("beam", side),))


def points_keep_apart(
    beam: Beam, segment: Segments, support: AnySupports, mesh: Mesh, load: Loads, probe: Probes
) -> Iterator[Fault]:
    """Points along the beam coincide or leave room for a cell; so do the ends of beam, segments and supports."""
    places: list[tuple[float, Key, str]] = [(beam.length, ("beam", "length"), "the free end")]
    if isinstance(support, BaseAndGland):
        places += [
            (0.0, ("support",), "the supported end"),
            (support.length, ("support", "length"), "the end of the support"),
        ]
    else:
        places.append((0.0, ("beam", "length"), "the end at x = 0"))
        for held, entry in keyed(support):
            places.append((entry.start, (*held, "from"), f"the start of the support {entry.name}"))
            places.append((entry.end, (*held, "to"), f"the end of the support {entry.name}"))
    for number, part in segment.items():
        places.append((part.start, ("segment", number, "from"), f"the start of the segment {part.name}"))
        places.append((part.end, ("segment", number, "to"), f"the end of the segment {part.name}"))
    points = [("load", number, entry.place.point) for number, entry in load.items()]
    points += [("probe", number, entry.point) for number, entry in probe.items()]
    for array, number, point in points:
        if point is not None:
            x = point[0] if isinstance(point, tuple) else point
            places.append((x, (array, number, "point"), f"[[{array}]] number {number + 1}"))
    beside = {(*at, "point"): point[1:] for *at, point in points if isinstance(point, tuple)}
    closest = CLOSEST * beam.thickness
    for (one, key, name), (other, next_key, next_name) in pairwise(sorted(places, key=itemgetter(0))):
        if mesh.file is None and SNAP * beam.thickness < other - one < closest:
            found, least = apart(other - one, closest)
            ranks = [(at[-1] == "point", len(at)) for at in (key, next_key)]  # points follow supports and segments
            moved, target = (key, other) if ranks[0] >= ranks[1] else (next_key, one)
            yield Fault(
                moved,
                f"{name} and {next_name} are {found} m apart along x",
                f"the same x, or at least {least} m between them: cells end at both",
                f"{moved[-1]} = {_moved_to(target, beside.get(moved, ()))}",
            )


def _moved_to(x: float, others: tuple[float, ...]) -> str:
    """Return a place as a case file has it: x, or all coordinates."""
    return f"[{', '.join(f'{value:.12g}' for value in (x, *others))}]" if others else f"{x:.12g}"


def loads_have_a_node(beam: Beam, mesh: Mesh, load: Loads) -> Iterator[Fault]:
    """A force on the axis acts at a node."""
    for number, entry in load.items():
        if (point := entry.place.point) is not None:
            yield from _between_nodes(("load", number, "point"), point, beam, mesh)


def probes_have_a_node(beam: Beam, mesh: Mesh, probe: Probes) -> Iterator[Fault]:
    """A probe on the axis looks at a node."""
    for number, entry in probe.items():
        yield from _between_nodes(("probe", number, "point"), entry.point, beam, mesh)


def _between_nodes(key: Key, point: float | Vector, beam: Beam, mesh: Mesh) -> Iterator[Fault]:
    """Yield the fault of a point on the axis between the nodes of an odd number of linear cells."""
    on_axis = not isinstance(point, tuple) or not any(point[1:])
    if mesh.degree == 2 or mesh.file is not None or not on_axis or not beam.rectangular:
        return
    for name in ("cells_through_thickness", "cells_across_width"):
        cells = getattr(mesh, name)
        if cells is not None and cells % 2 == 1:
            yield Fault(
                ("mesh", name),
                f"{cells} cells of degree 1, and a point on the axis: there is no node",
                "an even number of cells, or degree = 2",
                f"{name} = {cells + 1}",
                (key, ("mesh", "degree")),
            )


def directions_point_somewhere(mesh: Mesh, load: Loads) -> Iterator[Fault]:
    """A direction has as many components as the mesh has dimensions, and they are not all zero."""
    for number, entry in load.items():
        key = ("load", number, "direction")
        if entry.direction is None:
            continue
        up = "[0.0, 1.0]" if mesh.dimension == 2 else "[0.0, 0.0, 1.0]"
        if len(entry.direction) != mesh.dimension:
            yield Fault(
                key,
                f"{len(entry.direction)} components with dimension = {mesh.dimension}",
                f"{mesh.dimension} components",
                f"direction = {up} is upward",
                (("mesh", "dimension"),),
            )
        elif not any(entry.direction):
            yield Fault(key, "a vector of length 0", "a vector of any other length", f"direction = {up} is upward")


def load_names_differ(load: Loads) -> Iterator[Fault]:
    """Loads are distinguished by their names, and some, such as gravity, by being the only one of their type."""
    for number, entry in load.items():
        before = [(first, one) for first, one in load.items() if first < number]
        alike = [first for first, one in before if entry.alone and one.type == entry.type]
        namesakes = [first for first, one in before if one.name == entry.name]
        if alike:
            yield Fault(
                ("load", number, "type"),
                f"{entry.type}, twice",
                f"one load of type {entry.type}",
                "remove one of them",
                (("load", alike[0], "name"),),
            )
        elif namesakes:
            yield same_name(("load", number, "name"), entry.name, (("load", namesakes[0], "name"),))


def probe_names_differ(probe: Probes) -> Iterator[Fault]:
    """Probes are distinguished by their names."""
    yield from namesakes("probe", probe)


class Named(Protocol):
    """An entry of an array of tables with a name."""

    @property
    def name(self) -> str:
        """The name."""


def namesakes(array: str, entries: Mapping[int, Named]) -> list[Fault]:
    """Return the faults of names that earlier entries of the same array have."""
    taken: dict[str, int] = {}
    firsts = {number: taken.setdefault(entry.name, number) for number, entry in entries.items()}
    return [
        same_name((array, number, "name"), entries[number].name, ((array, first, "name"),))
        for number, first in firsts.items()
        if first != number
    ]


def same_name(key: Key, name: str, related: tuple[Key, ...]) -> Fault:
    """Return the fault of a name that another entry of the same array has."""
    return Fault(
        key,
        f'"{name}", which is also the name of number {int(related[0][1]) + 1}',
        f"a different name for every {key[0]}",
        f'name = "{name[:38]}_{int(key[1]) + 1}"',
        related,
    )
