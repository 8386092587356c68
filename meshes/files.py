"""A user's own mesh, read from a .msh file and distributed."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from mpi4py import MPI

from meshes.compat import mesh_from_gmsh
from meshes.geometry import BeamGeometry
from meshes.gmsh_session import gmsh_errors, gmsh_session
from meshes.groups import BODY
from meshes.rank_zero import on_rank_zero
from meshes.tagged import TaggedMesh


def read_mesh(comm: MPI.Comm, path: str | PathLike[str], geometry: BeamGeometry) -> TaggedMesh:
    """Read, check and distribute a mesh saved by gmsh, with named physical groups.

    Groups: body (all cells), base and gland (facets of the support); optionally end (x = 0) and tip
    (x = length). Others are ignored. Cells of one type, order 1 or 2. Coordinates in m, in the beam frame.

    Args:
        comm: Communicator over which the mesh is distributed.
        path: The .msh file; only rank 0 reads it.
        geometry: Dimensions that the mesh has to agree with; its points are not looked at.

    Returns:
        Mesh with the facet groups base and gland, and end and tip when the file has them.

    Raises:
        MeshError: on all ranks: the file cannot be read, groups or elements are missing or unsuitable, or the
            mesh is not the beam of the geometry.

    Collective.
    """
    with gmsh_session(comm):
        groups = on_rank_zero(comm, lambda: _load(Path(path), geometry))
        mesh, cells, facets = mesh_from_gmsh(comm, geometry.dimension, groups)
    return TaggedMesh(mesh, cells, facets, groups)


def _load(path: Path, geometry: BeamGeometry) -> dict[str, int]:
    """Load the file into the current gmsh model and check it; returns the tags of its facet groups."""
    import gmsh

    from meshes.element_check import check_elements
    from meshes.frame_check import check_frame
    from meshes.group_check import check_groups
    from meshes.msh_file import load_msh

    where = f"mesh file {path}"
    load_msh(path)
    with gmsh_errors(where, "a mesh that can be used"):
        groups = check_groups(where, geometry.dimension)
        nodes = check_elements(where, geometry.dimension, groups)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        points = np.empty((len(tags), 3))
        points[tags.astype(np.int64) - 1] = coordinates.reshape(-1, 3)
        used = {name: points[np.unique(rows)] for name, rows in nodes.items()}
        check_frame(where, geometry, used, used[BODY])
    return {name: tag for name, tag in groups.items() if name != BODY}
