"""Contradictions in geometry (beam, support, clearance, mesh) and in places and names of loads and probes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any

from gapbeam.meshes.beam_geometry import CLOSEST, SNAP
from gapbeam.solver.case.beam_profile import Beam, Segment, beam_at
from gapbeam.solver.case.case import Mesh, Probe
from gapbeam.solver.case.figure_table import Figure, figure_faults
from gapbeam.solver.case.solution_tables import Time
from gapbeam.solver.loads.attachments import JointChoice
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, counted, exceeds
from gapbeam.solver.schema.record_table import COMPONENTS
from gapbeam.solver.schema.table import Vector
from gapbeam.solver.supports.layout import Layout, keyed
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland

Loads = Mapping[int, Load]
"""Loads by their number in the case file, from 0, without those that have faults of their own."""
Probes = Mapping[int, Probe]
Joints = Mapping[int, JointChoice]
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
            f"{counted(len(coordinates), 'coordinate')}",
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
            along, *aside, across = map(float, entry.direction)
            same = [along, across] if mesh.dimension == 2 else [along, 0.0, across]
            meant = not any(aside) and any(same)
            yield Fault(
                key,
                f"{counted(len(entry.direction), 'component')} with dimension = {mesh.dimension}",
                f"{mesh.dimension} components",
                f"direction = {same}" if meant else f"direction = {up} is upward",
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


def figures_are_recorded(
    support: AnySupports, joint: Joints, load: Loads, probe: Probes, time: Time, figure: Mapping[int, Figure]
) -> Iterator[Fault]:
    """A figure is of a recorded quantity, at a place of the case."""
    yield from namesakes("figure", figure)
    layout = Layout.of(support)
    probes = [one.name for one in probe.values()]
    faces = [face.name for face in layout.faces]
    places = {
        "probe": probes,
        "turned_probe": [one.name for one in probe.values() if one.rotation],
        "gauge": [one.name for one in probe.values() if one.stress],
        "face": faces,
        "support": [one.name for one in layout.supports if any(f.startswith(f"{one.name}_") for f in faces)],
        "joint": [one.name for one in joint.values()],
        "load": [one.name for one in load.values()],
        "component": COMPONENTS[3],
    }
    yield from figure_faults(figure, places, time.end)
    for number, one in probe.items():
        if one.rotation and isinstance(one.point, tuple) and any(one.point[1:]):
            yield Fault(("probe", number, "rotation"), "true, at a point off the axis", "a point on the axis, x alone")


def namesakes(array: str, entries: Mapping[int, Any]) -> list[Fault]:
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


def support_is_part_of_the_beam(beam: Beam, support: AnySupports) -> Iterator[Fault]:
    """The support of [support] must not be longer than the beam."""
    if isinstance(support, BaseAndGland) and exceeds(support.length, beam.length):
        found, limit = apart(support.length, beam.length)
        yield Fault(
            ("support", "length"),
            f"{found} m",
            f"at most the length of the beam, {limit} m",
            "both lengths are in m",
            related=(("beam", "length"),),
        )


def supports_squeeze_little(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """The equations are those of small strains: a section squeezed to less than half is refused."""
    for key, one in keyed(support):
        if one.length <= 0.0:
            continue
        thickness = beam_at(beam, segment.values(), 0.5 * (one.start + one.end)).thickness
        squeezed, name = (0.5 * thickness, "radius") if one.around else (thickness, "thickness")
        if exceeds(-0.5 * squeezed, one.clearance):
            found, limit = apart(one.clearance, -0.5 * squeezed)
            yield Fault(
                (*key, "clearance"),
                f"{found} m, an interference of more than half the {name} of the beam",
                f"at least {limit} m",
                f"is it in mm? In m it is {one.clearance / 1000:g}",
                (("beam", "thickness"),),
            )


def cells_fit_the_dimension(mesh: Mesh) -> Iterator[Fault]:
    """Triangles and quadrilaterals in 2D, tetrahedra and hexahedra in 3D; no keys of the other dimension."""
    shapes = {2: ("triangle", "quadrilateral"), 3: ("tetrahedron", "hexahedron")}[mesh.dimension]
    related: tuple[Key, ...] = (("mesh", "dimension"),)
    if mesh.cell is not None and mesh.cell not in shapes:
        twin = {
            "triangle": "tetrahedron",
            "quadrilateral": "hexahedron",
            "tetrahedron": "triangle",
            "hexahedron": "quadrilateral",
        }[mesh.cell]
        yield Fault(
            ("mesh", "cell"),
            f'"{mesh.cell}" with dimension = {mesh.dimension}',
            f'"{shapes[0]}" or "{shapes[1]}" in {mesh.dimension}D',
            f'cell = "{twin}", or dimension = {5 - mesh.dimension}',
            related,
        )
    if mesh.dimension == 2 and mesh.cells_across_width is not None:
        yield Fault(
            ("mesh", "cells_across_width"),
            f"{mesh.cells_across_width} with dimension = 2",
            "no such key in 2D, where the mesh has no width",
            "remove it, or dimension = 3",
            related,
        )
    if mesh.dimension == 3 and mesh.plane == "strain":
        yield Fault(
            ("mesh", "plane"),
            '"strain" with dimension = 3',
            "no such key in 3D, where nothing is assumed across the width",
            "remove it, or dimension = 2",
            related,
        )


def cells_fit_the_beam(beam: Beam, support: AnySupports, mesh: Mesh) -> Iterator[Fault]:
    """Cells are no longer than the part they divide, and finer toward the edge of the base."""
    shortest = Layout.of(support).shortest
    length = ("support", "length") if isinstance(support, BaseAndGland) else ("support",)
    for name, part, longest, related in (
        ("size", "beam", beam.length, ("beam", "length")),
        ("support_size", "support", shortest if shortest > 0.0 else beam.length, length),
    ):
        size = getattr(mesh, name)
        if size is not None and exceeds(size, longest, beam.length):
            found, limit = apart(size, longest)
            yield Fault(
                ("mesh", name),
                f"{found} m",
                f"at most the length of the {part}, {limit} m",
                f"{name} = {limit}",
                (related,),
            )
    around = beam.thickness / 3 if mesh.support_size is None else mesh.support_size
    if mesh.edge_size is not None and exceeds(mesh.edge_size, around):
        found, limit = apart(mesh.edge_size, around)
        default = " (default thickness/3)" if mesh.support_size is None else ""
        yield Fault(
            ("mesh", "edge_size"),
            f"{found} m",
            f"at most support_size, {limit} m{default}",
            "cells are finest at the edge of the base: give support_size too",
            (("mesh", "support_size"),),
        )


def mesh_file_says_it_all(mesh: Mesh) -> Iterator[Fault]:
    """A mesh file exists, and no key of a built mesh is given beside it."""
    if mesh.file is None:
        return
    key, expected = ("mesh", "file"), "a gmsh file .msh, its path relative to the case file"
    path = Path(mesh.file)
    if path.suffix != ".msh":
        yield Fault(key, f"{path}", expected, "gmsh writes .msh: gmsh -3 beam.geo -o beam.msh")
    elif not _is_file(path):
        here = path.name if _is_file(Path(path.name)) else ""
        hint = f"{Path(here).absolute()} is a file: give that path" if here else ""
        yield Fault(key, f"{mesh.file!r:.200}, where there is no file", expected, hint)
    idle = ("size", "support_size", "edge_size", "cell", "cells_through_thickness", "cells_across_width")
    for name in idle:
        if getattr(mesh, name) is not None:
            yield Fault(
                ("mesh", name),
                f"{name} together with a mesh file",
                "one of the two: the file already holds its cells",
                f"remove {name}, or file",
                (key,),
            )


def _is_file(path: Path) -> bool:
    """Return whether there is a file, also of names that are too long, or hold NUL, and in folders that are closed."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
