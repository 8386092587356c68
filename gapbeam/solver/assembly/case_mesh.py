"""Tagged mesh of a case, from its tables [beam], [support] and [mesh]."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gapbeam.meshes.beam_geometry import BeamGeometry, BeamStep, ContactSpan
from gapbeam.meshes.mesh_size import BeamSizing
from gapbeam.meshes.rank_zero import with_mpi
from gapbeam.meshes.sections.section_patches import CELLS_THROUGH, SectionPatches, rectangle_patches, shared_patches
from gapbeam.meshes.tagged_mesh import TaggedMesh, build_beam
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import BeamModel, RigidModel

if TYPE_CHECKING:
    from mpi4py import MPI


def mesh_of_case(case: Case, comm: MPI.Comm, assembled: bool = True) -> TaggedMesh:
    """Mesh a case, or read the mesh file that it names.

    Args:
        case: The case.
        comm: The ranks.
        assembled: Whether the model of the case is made on the mesh: layers need no DOLFINx for pictures.

    Collective.
    """
    if case.mesh.file is not None:
        from gapbeam.meshes.user_mesh.user_mesh import read_mesh

        return read_mesh(with_mpi(comm), Path(case.mesh.file), geometry_of(case))
    assembled = assembled and not isinstance(case.model, BeamModel | RigidModel)
    return build_beam(comm, geometry_of(case), sizing_of(case), assembled)


def geometry_of(case: Case) -> BeamGeometry:
    """Return the beam of a case, with the points that must be nodes."""
    mesh, layout, profile = case.mesh, case.layout, case.profile
    section, steps = _sections(case)
    points = [point for load in case.load if (point := load.place.point) is not None]
    points += [one.point for one in (*case.probe, *case.joint, *case.mass)]
    return BeamGeometry(
        dimension=mesh.dimension,
        length=case.beam.length,
        thickness=profile.thickest,
        width=max(piece.beam.width for piece in profile.pieces),
        support_length=layout.end,
        points=tuple(_coordinates(point, mesh.dimension) for point in points),
        section=section,
        steps=steps,
        breaks=profile.steps,
        spans=tuple(
            ContactSpan(face.name, face.side > 0.0, one.start, one.end, face.around)
            for one in layout.supports
            for face in one.faces
        ),
    )


def _sections(case: Case) -> tuple[SectionPatches | None, tuple[BeamStep, ...]]:
    """Return the patches of the section, of all sections of a beam with steps, and its parts of one section each."""
    mesh, profile = case.mesh, case.profile
    counts = mesh.cells_through_thickness, mesh.cells_across_width
    if profile.one_section:
        return profile.pieces[0].beam.patches(*counts), ()
    pieces = profile.pieces
    if mesh.dimension == 2 or mesh.cell == "tetrahedron":
        return None, tuple(BeamStep(one.start, one.end, one.beam.thickness, one.beam.width) for one in pieces)
    through, across = (count or CELLS_THROUGH for count in counts)
    whole, parts = shared_patches(
        [
            piece.beam.patches(*counts) or rectangle_patches(piece.beam.thickness, piece.beam.width, through, across)
            for piece in pieces
        ]
    )
    return whole, tuple(
        BeamStep(piece.start, piece.end, piece.beam.thickness, piece.beam.width, section, filled)
        for piece, (section, filled) in zip(pieces, parts, strict=True)
    )


def sizing_of(case: Case) -> BeamSizing:
    """Return the mesh size of a case for gmsh."""
    mesh = case.mesh
    return BeamSizing(
        cell=mesh.cell,
        size=mesh.size,
        support_size=mesh.support_size,
        edge_size=mesh.edge_size,
        cells_through_thickness=mesh.cells_through_thickness,
        cells_across_width=mesh.cells_across_width,
    )


def _coordinates(point: float | tuple[float, ...], dimension: int) -> tuple[float, ...]:
    given = np.atleast_1d(np.array(point, dtype=float))
    return tuple(float(x) for x in np.pad(given, (0, dimension - len(given))))
