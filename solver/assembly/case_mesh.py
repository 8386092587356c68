"""From the tables [beam], [support] and [mesh] of a case to a tagged mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.beam_mesh import build_beam
from gapbeam.meshes.contact_span import ContactSpan
from gapbeam.meshes.sizing.mesh_size import BeamSizing
from gapbeam.meshes.tagged_mesh import TaggedMesh
from gapbeam.meshes.user_mesh.user_mesh import read_mesh
from gapbeam.solver.case.case import Case


def mesh_of_case(case: Case, comm: MPI.Comm) -> TaggedMesh:
    """Mesh a case with gmsh, or read the mesh file that it names. Collective."""
    if case.mesh.file is not None:
        return read_mesh(comm, Path(case.mesh.file), geometry_of(case))
    return build_beam(comm, geometry_of(case), sizing_of(case))


def geometry_of(case: Case) -> BeamGeometry:
    """Return the beam of a case, with the points that shall be nodes."""
    mesh, beam, layout = case.mesh, case.beam, case.layout
    points = [point for load in case.load if (point := load.place.point) is not None]
    points += [probe.point for probe in case.probe]
    return BeamGeometry(
        dimension=mesh.dimension,
        length=beam.length,
        thickness=beam.thickness,
        width=beam.width,
        support_length=layout.end,
        points=tuple(_coordinates(point, mesh.dimension) for point in points),
        section=beam.patches(mesh.cells_through_thickness, mesh.cells_across_width),
        spans=tuple(
            ContactSpan(face.name, face.side > 0.0, one.start, one.end, face.around)
            for one in layout.supports
            for face in one.faces
        ),
    )


def sizing_of(case: Case) -> BeamSizing:
    """Return how fine gmsh shall mesh a case."""
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
