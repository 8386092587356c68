"""From the tables [beam], [support] and [mesh] of a case to a tagged mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mpi4py import MPI

from meshes.build import build_beam
from meshes.files import read_mesh
from meshes.geometry import BeamGeometry
from meshes.sizing import BeamSizing
from meshes.tagged import TaggedMesh
from solver.case import Case, PointForce


def mesh_of_case(case: Case, comm: MPI.Comm) -> TaggedMesh:
    """Mesh a case with gmsh, or read the mesh file that it names. Collective."""
    mesh, beam = case.mesh, case.beam
    points = [load.point for load in case.load if isinstance(load, PointForce)]
    points += [probe.point for probe in case.probe]
    geometry = BeamGeometry(
        dimension=mesh.dimension,
        length=beam.length,
        thickness=beam.thickness,
        width=beam.width,
        support_length=case.support.length,
        points=tuple(_coordinates(point, mesh.dimension) for point in points),
    )
    if mesh.file is not None:
        return read_mesh(comm, Path(mesh.file), geometry)
    sizing = BeamSizing(
        cell=mesh.cell,
        size=mesh.size,
        support_size=mesh.support_size,
        edge_size=mesh.edge_size,
        cells_through_thickness=mesh.cells_through_thickness,
        cells_across_width=mesh.cells_across_width,
    )
    return build_beam(comm, geometry, sizing)


def _coordinates(point: float | tuple[float, ...], dimension: int) -> tuple[float, ...]:
    given = np.atleast_1d(np.array(point, dtype=float))
    return tuple(float(x) for x in np.pad(given, (0, dimension - len(given))))
