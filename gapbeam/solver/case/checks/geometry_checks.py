"""Contradictions in the geometry of a case: beam, support, clearance and mesh."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from gapbeam.solver.case.beam_profile import beam_at
from gapbeam.solver.case.case import Beam, Mesh
from gapbeam.solver.case.checks.place_checks import Segments
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.supports.layout import Layout, keyed
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland
from gapbeam.solver.wording.short_words import apart, exceeds


def support_is_part_of_the_beam(beam: Beam, support: AnySupports) -> Iterator[Fault]:
    """The support of [support] must be shorter than the beam."""
    if isinstance(support, BaseAndGland) and not exceeds(beam.length, support.length):
        found, limit = apart(support.length, beam.length)
        yield Fault(
            ("support", "length"),
            f"{found} m",
            f"less than the length of the beam, {limit} m",
            "both lengths are in m; a beam supported all along does not vibrate",
            related=(("beam", "length"),),
        )


def supports_squeeze_little(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """The equations are those of small strains: what is squeezed to less than half is none of theirs."""
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
    """A mesh file exists, and leaves nothing for the keys of the built mesh to say."""
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
