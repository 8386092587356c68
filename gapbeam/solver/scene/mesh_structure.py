"""Structures from mesh files of solids: cells of one or several materials become sparse matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.case.checks.usual_ranges import USUAL, asked
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, positive, shown
from gapbeam.solver.scene.finer_mesh import finer_mesh, may_be_finer
from gapbeam.solver.scene.imported_points import Label, PointGiven, Rows
from gapbeam.solver.scene.mesh_files import SolidMesh, read_mesh
from gapbeam.solver.scene.solid_cells import KINDS, PLANE, Indices
from gapbeam.solver.scene.solid_material import OrthotropicMaterial, Plane, moduli
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.scene.structure_files import ImportedModel, MeshSurface
from gapbeam.solver.scene.structure_geometry import Pose
from gapbeam.solver.system.operators import Array

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254}
"""Units of length of mesh files, m."""
SolidMaterial = Material | OrthotropicMaterial
Materials = SolidMaterial | Mapping[str, SolidMaterial]


@checked
def from_mesh(
    file: str | PathLike[str],
    materials: Materials,
    *,
    units: str,
    points: Mapping[str, PointGiven] | None = None,
    clamped: Sequence[Label] = (),
    plane: Plane | None = None,
    thickness: float | None = None,
    frame: Sequence[float] | None = None,
    place: Pose | None = None,
    name: str = "",
    gauges: Sequence[str] = (),
) -> Structure:
    """Return a structure of linear elastic solids from a mesh file.

    Weight and base motions act along any direction of space where `frame` is left out.

    Args:
        file: Input of Abaqus or CalculiX (`.inp`), or what meshio reads: Nastran (`.bdf`), gmsh (`.msh`), VTK, MED.
            Cells of one kind, order 1 or 2: tetrahedra or hexahedra; triangles or quadrilaterals in a plane z =
            constant.
        materials: Results of `material` or `orthotropic`: one for all cells, or by group of cells; "" are all other
            cells.
        units: Units of the coordinates: "m", "cm", "mm" or "inch".
        points: Points by name, as in `read_structure`; sets are those of nodes, and the nodes of groups of cells or
            faces.
        clamped: As in `read_structure`.
        plane: Cells in the plane: "stress" or "strain".
        thickness: Thickness of cells in the plane, m.
        frame: As in `read_structure`.
        place: Place of the structure in space.
        name: Name of the structure.
        gauges: Points whose stress is recorded: normal stress along each of their directions and von Mises stress, the
            mean of the cells that meet there.

    Raises:
        UserError: The file cannot be read, has shells, beams, several kinds of cells, inverted cells or several pieces;
            a group is unknown, a cell has no material or two; a unit or a label is unknown.
    """
    model = mesh_model(file, materials, units=units, plane=plane, thickness=thickness, place=place, name=name)
    return model.structure(points or {}, clamped, frame, gauges=gauges)[0]


def mesh_model(
    file: str | PathLike[str], materials: Materials, *, units: str, plane: Plane | None, thickness: float | None,
    place: Pose | None, name: str, finer: bool = False,
) -> ImportedModel:  # fmt: skip
    """Return the matrices of a mesh file before anything is clamped; see `from_mesh`.

    With `finer`, they are those of a mesh twice as fine, where that is not too large.
    """
    where = f"structure {name or '?'}"
    if units not in LENGTHS:
        raise ArgumentError(f"{where}: found units {units!r}, expected one of {', '.join(LENGTHS)}", "units")
    mesh, meter = read_mesh(Path(file)), LENGTHS[units]
    flat = KINDS[mesh.kind].dimension == 2
    if finer and may_be_finer(len(mesh.labels) * (2 if flat else 3), 2 if flat else 3):
        mesh = finer_mesh(mesh)
    for key, value in (("plane", plane), ("thickness", thickness)):
        if (value is not None) is not flat:
            choice = '"stress" or "strain"' if key == "plane" else "a thickness, m"
            expected = f"{choice}, for cells in a plane; shells are no solids" if flat else "none in space"
            found = "nothing" if value is None else repr(value)
            raise ArgumentError(f"{where}: found {found} as {key} of {mesh.kind} cells, expected {expected}", key)
    if plane not in (None, "stress", "strain"):
        raise ArgumentError(f"{where}: found plane {plane!r}, expected 'stress' or 'strain'", "plane")
    deep = 1.0 if thickness is None else float(positive(thickness, f"{where}: thickness"))
    kinds, of_cell = _of_cells(mesh, materials, where)
    cells = mesh.made(meter)
    stresses = np.array([moduli(one, plane) for one in kinds])
    tensors = stresses[:, PLANE] if flat else stresses
    densities = np.array([one.density for one in kinds])
    K, M = cells.matrices(tensors, of_cell, densities, deep)
    ways = range(1, 3 if flat else 4)
    rows = Rows([f"{node}.{way}" for node in mesh.labels for way in ways], mesh.nodes, meter, True, place or Pose())
    spans = " x ".join(f"{one:.4g}" for one in np.ptp(cells.places, axis=0))
    for question in asked(f"{where}: its span as", USUAL[0], float(np.ptp(cells.places, axis=0).max())):
        LOG.warning("%s", question)
    LOG.info(
        "%s: %d %s cells, %d nodes, %s m, %.6g kg", where, len(of_cell), mesh.kind, len(mesh.labels), spans,
        M.sum() / cells.kind.dimension,
    )  # fmt: skip
    if KINDS[mesh.kind].order == 1:
        LOG.info("%s: cells of order 1 are too stiff in bending unless many lie across; order 2 needs fewer", where)

    def stress_at(nodes: Sequence[str], where: str, argument: str) -> Array:
        number = {label: k for k, label in enumerate(mesh.labels)}
        met = list(cells.at_nodes([number[node] for node in nodes]))
        if len({int(of_cell[cell]) for cell, _ in met}) > 1:
            raise ArgumentError(
                f"{where}: found a stress where several materials meet, expected a node within one: it jumps there",
                argument,
            )
        return np.asarray(np.mean([stresses[of_cell[cell]] @ B for cell, B in met], axis=0))

    return ImportedModel(
        K, M, None, rows, name, is_placed=True, surface=MeshSurface(*mesh.surface()), stress_at=stress_at
    )


def _of_cells(mesh: SolidMesh, materials: Materials, where: str) -> tuple[list[SolidMaterial], Indices]:
    """Return the materials, and which of them each cell has."""
    given: Mapping[str, Any] = materials if isinstance(materials, Mapping) else {"": materials}
    found = np.full(len(mesh.cells), -1)
    for number, (group, one) in enumerate(given.items()):
        if not isinstance(one, SolidMaterial):
            raise ArgumentError(
                f"{where}: found {shown(one)}, expected a material, as of gapbeam.material or gapbeam.orthotropic",
                "materials",
            )
        if not group:
            continue
        if group.upper() not in mesh.groups:
            known = ", ".join(sorted(mesh.groups)) or "none"
            raise ArgumentError(f"{where}: found the group {group!r}, expected one of the cells: {known}", "materials")
        some = mesh.groups[group.upper()]
        twice = some[found[some] >= 0]
        if len(twice):
            other = list(given)[found[twice[0]]]
            raise ArgumentError(
                f"{where}: found {len(twice)} cells in both {other} and {group}, expected one material for each cell",
                "materials",
            )
        found[some] = number
    if "" in given:
        found[found < 0] = list(given).index("")
    bare = np.flatnonzero(found < 0)
    if len(bare):
        at = np.mean([mesh.nodes.places[mesh.labels[i]] for i in mesh.cells[bare[0]]], axis=0)
        known = ", ".join(sorted(mesh.groups)) or "none"
        raise ArgumentError(
            f"{where}: found {len(bare)} cells without a material, the first at ({', '.join(f'{x:.4g}' for x in at)}), "
            f"expected a material for each group ({known}), or one without a group for all others",
            "materials",
        )
    return list(given.values()), found
