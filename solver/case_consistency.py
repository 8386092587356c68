"""Contradictions between the tables of a case, each found by a small function that takes the tables it needs."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from itertools import combinations
from pathlib import Path

from solver.case import (
    BaseMotion,
    Beam,
    Case,
    Contact,
    Damping,
    Gates,
    Gravity,
    HarmonicForce,
    Load,
    Material,
    Mesh,
    Output,
    Probe,
    Support,
    Time,
    Vector,
)
from solver.case_faults import Fault, Key

Check = Callable[..., Iterator[Fault]]
Loads = Mapping[int, Load]
Probes = Mapping[int, Probe]

CHECKS: list[Check] = []
MOST_STEPS = 1e9
MULTIPLE_TOLERANCE = 1e-6


def check(function: Check) -> Check:
    """Add a check: its parameters are tables of the case file; `load` and `probe` are {number: entry}."""
    CHECKS.append(function)
    return function


def contradictions(tables: Mapping[str, object]) -> list[Fault]:
    """Return the faults of all checks whose tables are there.

    Args:
        tables: The intact tables by name, arrays of tables as {number: entry}.
    """
    runnable = (function for function in CHECKS if set(inspect.signature(function).parameters) <= set(tables))
    return [
        fault
        for function in runnable
        for fault in function(**{name: tables[name] for name in inspect.signature(function).parameters})
    ]


def contradictions_in(case: Case) -> list[Fault]:
    """Return the contradictions in a case that was made in Python."""
    tables = {name: getattr(case, name) for name in Case.model_fields}
    return contradictions({n: dict(enumerate(t)) if isinstance(t, tuple) else t for n, t in tables.items()})


@check
def support_is_part_of_the_beam(beam: Beam, support: Support) -> Iterator[Fault]:
    """The support must be shorter than the beam."""
    if support.length >= beam.length:
        yield Fault(
            ("support", "length"),
            f"{support.length:g} m",
            f"less than the length of the beam, {beam.length:g} m",
            "both lengths are in m; a beam supported all along does not vibrate",
            related=(("beam", "length"),),
        )


@check
def clearance_is_small(beam: Beam, support: Support) -> Iterator[Fault]:
    """The beam must stay nearly straight in its support, and may be squeezed only a little."""
    key, related = ("support", "clearance"), (("beam", "thickness"), ("support", "length"))
    largest = min(10 * beam.thickness, 0.5 * support.length)
    if support.clearance > largest:
        yield Fault(
            key,
            f"{support.clearance:g} m, {support.clearance / beam.thickness:.3g} times the thickness of the beam",
            f"at most {largest:g} m: the smaller of 10 thicknesses and half the length of the support",
            f"is it in mm? In m it is {support.clearance / 1000:g}",
            related,
        )
    if support.clearance < -0.5 * beam.thickness:
        yield Fault(
            key,
            f"{support.clearance:g} m, an interference of more than half the thickness of the beam",
            f"at least {-0.5 * beam.thickness:g} m",
            f"is it in mm? In m it is {support.clearance / 1000:g}",
            related[:1],
        )


@check
def damping_is_given_once(damping: Damping) -> Iterator[Fault]:
    """Rayleigh damping is given by frequencies and ratios, or by its two coefficients, and never by half."""
    pairs = (("frequencies", "ratios"), ("mass", "stiffness"))
    given = [name for pair in pairs for name in pair if getattr(damping, name) is not None]
    ways = [[name for name in pair if name in given] for pair in pairs]
    if all(ways):
        yield Fault(
            ("damping", given[-1]),
            f"{', '.join(given)}: damping given in two ways",
            "frequencies and ratios, or mass and stiffness",
            "remove one of the two pairs",
            tuple(("damping", name) for name in given[:-1]),
        )
        return
    for pair, way in zip(pairs, ways, strict=True):
        if len(way) == 1:
            missing = pair[1 - pair.index(way[0])]
            zero = f"; {missing} = 0.0 if there is none" if missing in pairs[1] else ""
            yield Fault(
                ("damping", way[0]),
                f"{way[0]} without {missing}",
                f"both {pair[0]} and {pair[1]}",
                f"add {missing}{zero}",
            )


@check
def damping_is_positive(damping: Damping) -> Iterator[Fault]:
    """Two different frequencies, and ratios for which neither coefficient is negative."""
    if damping.frequencies is None or damping.ratios is None:
        return
    (low, low_ratio), (high, high_ratio) = sorted(zip(damping.frequencies, damping.ratios, strict=True))
    if low == high:
        yield Fault(
            ("damping", "frequencies"),
            f"{low:g} Hz twice",
            "two different frequencies",
            "one below and one above the frequencies of interest",
        )
        return
    least, most = low_ratio * low / high, low_ratio * high / low
    if not least * (1 - 1e-9) <= high_ratio <= most * (1 + 1e-9):
        coefficient = "mass" if high_ratio > most else "stiffness"
        yield Fault(
            ("damping", "ratios"),
            f"{low_ratio:g} at {low:g} Hz and {high_ratio:g} at {high:g} Hz: the {coefficient} coefficient is negative",
            f"a ratio from {least:.4g} to {most:.4g} at {high:g} Hz, for {low_ratio:g} at {low:g} Hz",
            "bring the ratios closer together, or the frequencies further apart",
            (("damping", "frequencies"),),
        )


@check
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


@check
def cells_fit_the_beam(beam: Beam, support: Support, mesh: Mesh) -> Iterator[Fault]:
    """Cells are no longer than the part they divide, and finer toward the edge of the base."""
    for name, part, longest in (
        ("size", "beam", beam.length),
        ("support_size", "support", support.length),
    ):
        size = getattr(mesh, name)
        if size is not None and size > longest:
            yield Fault(
                ("mesh", name),
                f"{size:g} m",
                f"at most the length of the {part}, {longest:g} m",
                "sizes are in m",
                ((part, "length"),),
            )
    around = beam.thickness / 3 if mesh.support_size is None else mesh.support_size
    if mesh.edge_size is not None and mesh.edge_size > around:
        default = " (default thickness/3)" if mesh.support_size is None else ""
        yield Fault(
            ("mesh", "edge_size"),
            f"{mesh.edge_size:g} m",
            f"at most support_size, {around:g} m{default}",
            "cells are finest at the edge of the base: give support_size too",
            (("mesh", "support_size"),),
        )


@check
def mesh_file_says_it_all(mesh: Mesh) -> Iterator[Fault]:
    """A mesh file exists, and leaves nothing for the keys of the built mesh to say."""
    if mesh.file is None:
        return
    key, expected = ("mesh", "file"), "a gmsh file .msh, its path relative to the case file"
    path = Path(mesh.file)
    if path.suffix != ".msh":
        yield Fault(key, f"{path}", expected, "gmsh writes .msh: gmsh -3 beam.geo -o beam.msh")
    elif "\0" in mesh.file or not path.is_file():
        here = path.name if "\0" not in mesh.file and Path(path.name).is_file() else ""
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


@check
def loads_lie_in_the_beam(beam: Beam, mesh: Mesh, load: Loads) -> Iterator[Fault]:
    """Forces act at points of the beam."""
    for number, entry in load.items():
        if isinstance(entry, HarmonicForce):
            yield from _outside(("load", number, "point"), entry.point, beam, mesh)


@check
def probes_lie_in_the_beam(beam: Beam, mesh: Mesh, probe: Probes) -> Iterator[Fault]:
    """Probes look at points of the beam."""
    for number, entry in probe.items():
        yield from _outside(("probe", number, "point"), entry.point, beam, mesh)


def _outside(key: Key, point: float | Vector, beam: Beam, mesh: Mesh) -> Iterator[Fault]:
    """Say where a point leaves the beam, whose axis is y = 0 in 2D and y = z = 0 in 3D."""
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
    half = {2: (beam.thickness / 2,), 3: (beam.width / 2, beam.thickness / 2)}[mesh.dimension]
    # A mesh file may lie elsewhere across the axis than the meshes that are built here.
    across = half[: len(coordinates) - 1] if mesh.file is None else ()
    limits = [(0.0, beam.length), *((-size, size) for size in across)]
    for name, value, (least, most) in zip("xyz", coordinates, limits, strict=False):
        margin = 1e-9 * beam.length
        if not least - margin <= value <= most + margin:
            inside = least <= value / 1000 <= most
            hint = f"is it in mm? In m it is {value / 1000:g}" if inside and value else "coordinates are in m"
            if name != "x":
                hint = f"{name} = 0 is the axis of the beam, not its face; coordinates are in m"
            yield Fault(
                key,
                f"{name} = {value:g} m, outside the beam",
                f"{name} from {least:g} to {most:g} m",
                hint,
                (("beam", {"x": "length", "y": "width" if mesh.dimension == 3 else "thickness"}.get(name, "thickness")),),
            )


@check
def loads_have_a_node(mesh: Mesh, load: Loads) -> Iterator[Fault]:
    """A force on the axis acts at a node."""
    for number, entry in load.items():
        if isinstance(entry, HarmonicForce):
            yield from _between_nodes(("load", number, "point"), entry.point, mesh)


@check
def probes_have_a_node(mesh: Mesh, probe: Probes) -> Iterator[Fault]:
    """A probe on the axis looks at a node."""
    for number, entry in probe.items():
        yield from _between_nodes(("probe", number, "point"), entry.point, mesh)


def _between_nodes(key: Key, point: float | Vector, mesh: Mesh) -> Iterator[Fault]:
    """Say where a point on the axis falls between the nodes of linear cells: an odd number of them has none there."""
    on_axis = not isinstance(point, tuple) or not any(point[1:])
    if mesh.degree == 2 or mesh.file is not None or not on_axis:
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


@check
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


@check
def load_names_differ(load: Loads) -> Iterator[Fault]:
    """Loads are told apart by their names, gravity by being the only one."""
    for (first, one), (second, other) in combinations(load.items(), 2):
        related: tuple[Key, ...] = (("load", first, "name"),)
        if isinstance(one, Gravity) and isinstance(other, Gravity):
            yield Fault(
                ("load", second, "type"), "gravity, twice", "one load of type gravity", "remove one of them", related
            )
        elif one.name == other.name:
            yield _same_name(("load", second, "name"), other.name, related)


@check
def probe_names_differ(probe: Probes) -> Iterator[Fault]:
    """Probes are told apart by their names."""
    for (first, one), (second, other) in combinations(probe.items(), 2):
        if one.name == other.name:
            yield _same_name(("probe", second, "name"), other.name, (("probe", first, "name"),))


def _same_name(key: Key, name: str, related: tuple[Key, ...]) -> Fault:
    return Fault(
        key,
        f'"{name}", which is also the name of number {int(related[0][1]) + 1}',
        f"a different name for every {key[0]}",
        f'name = "{name[:38]}_{int(key[1]) + 1}"',
        related,
    )


@check
def run_has_steps(time: Time) -> Iterator[Fault]:
    """A run has at least one step, and not more than can ever be marched."""
    steps = time.end / time.step
    if steps < 1 - MULTIPLE_TOLERANCE:
        yield Fault(
            ("time", "step"),
            f"{time.step:g} s, longer than the whole run",
            f"at most end, {time.end:g} s, and much less to be of use",
            "are step and end swapped, or in ms?",
            (("time", "end"),),
        )
    elif steps > MOST_STEPS:
        yield Fault(
            ("time", "step"),
            f"{time.step:g} s, which makes {steps:.3g} steps until {time.end:g} s",
            f"at most {MOST_STEPS:g} steps",
            f"a step of {time.end / 1e5:g} s makes 100000 steps",
            (("time", "end"),),
        )


@check
def step_follows_the_forcing(time: Time, load: Loads) -> Iterator[Fault]:
    """The step is far shorter than the period of every load."""
    for number, entry in load.items():
        if isinstance(entry, HarmonicForce | BaseMotion) and time.step >= 0.5 / entry.frequency:
            yield Fault(
                ("time", "step"),
                f"{time.step:g} s, with a load of {entry.frequency:g} Hz, whose period is {1 / entry.frequency:g} s",
                "far less than half a period; 50 steps per period follow it well",
                f"step = {0.02 / entry.frequency:.3g}",
                (("load", number, "frequency"),),
            )


@check
def outputs_fall_on_steps(time: Time, output: Output) -> Iterator[Fault]:
    """Output intervals are whole numbers of steps."""
    for name in ("history_interval", "fields_interval"):
        interval = getattr(output, name)
        if interval is None:
            continue
        ratio = interval / time.step
        steps = max(1, round(ratio)) if ratio < 1e15 else 1
        key, related = ("output", name), (("time", "step"),)
        if interval > time.end * (1 + MULTIPLE_TOLERANCE):
            expected = f"at most the end of the run, {time.end:g} s"
            yield Fault(key, f"{interval:g} s", expected, "intervals are in s", (("time", "end"),))
        elif abs(ratio - steps) > MULTIPLE_TOLERANCE:
            few = f"{ratio:.6g} steps of {time.step:g} s"
            nearest = f"{name} = {float(f'{steps * time.step:.12g}')!r}"
            yield Fault(key, f"{interval:g} s, {few}", "a whole number of steps, at least 1", nearest, related)


@check
def contact_is_shallow(support: Support, contact: Contact) -> Iterator[Fault]:
    """The damped law is switched on over a depth far smaller than the gap."""
    if 0 < support.clearance <= contact.touch_depth:
        yield Fault(
            ("contact", "touch_depth"),
            f"{contact.touch_depth:g} m",
            f"far less than the clearance, {support.clearance:g} m",
            f"touch_depth = {support.clearance / 1e4:.3g}",
            (("support", "clearance"),),
        )


@check
def contact_carries_the_beam(
    beam: Beam, material: Material, support: Support, contact: Contact, load: Loads
) -> Iterator[Fault]:
    """The contact is stiff enough for the weight not to push the beam through its support."""
    gravity = max((entry.acceleration for entry in load.values() if isinstance(entry, Gravity)), default=0.0)
    if contact.stiffness == "auto" or gravity == 0.0:
        return
    pressure = material.density * gravity * beam.thickness * beam.length / support.length
    if pressure / contact.stiffness > beam.thickness:
        yield Fault(
            ("contact", "stiffness"),
            f"{contact.stiffness:g} Pa/m: the beam sinks {pressure / contact.stiffness:.3g} m by its own weight",
            f"far more than {pressure / beam.thickness:.3g} Pa/m (stiffness per area: N/m divided by the area in m^2)",
            'stiffness = "auto"',
            (("material", "density"), ("beam", "thickness")),
        )


@check
def gates_are_in_order(gates: Gates) -> Iterator[Fault]:
    """What one impact may do does not end the run at once."""
    if gates.total_growth < gates.impact_growth:
        yield Fault(
            ("gates", "total_growth"),
            f"{gates.total_growth:g}, less than impact_growth, {gates.impact_growth:g}",
            "at least impact_growth: one impact may not end the run while it keeps its own limit",
            f"total_growth = {max(0.05, 20 * gates.impact_growth):g}",
            (("gates", "impact_growth"),),
        )


def is_whole(ratio: float) -> bool:
    """Whether a ratio of times is a whole number to the tolerance of the case file."""
    return math.isclose(ratio, round(ratio), rel_tol=0.0, abs_tol=MULTIPLE_TOLERANCE)
