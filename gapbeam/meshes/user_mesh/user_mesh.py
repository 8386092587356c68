"""A user's own mesh, read from a .msh file and distributed."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BODY, ENDS, BeamGeometry
from gapbeam.meshes.distributed_mesh import mesh_from_gmsh
from gapbeam.meshes.gmsh_model import gmsh_errors, gmsh_session
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.tagged_mesh import TaggedMesh, mean_section
from gapbeam.meshes.user_mesh.frame_check import TOLERANCE, check_frame


def read_mesh(comm: MPI.Comm, path: str | PathLike[str], geometry: BeamGeometry) -> TaggedMesh:
    """Read, check and distribute a mesh saved by gmsh, with named physical groups.

    Groups: body (all cells), those of the spans (facets of the supports); optionally end (x = 0) and tip
    (x = length). Others are ignored. Cells of one type, order 1 or 2. Coordinates in m, in the beam frame.

    Args:
        comm: Communicator over which the mesh is distributed.
        path: The .msh file; only rank 0 reads it.
        geometry: Dimensions that the mesh has to agree with; its points are not looked at.

    Returns:
        Mesh with the facet groups of the spans, and end and tip when the file has them.

    Raises:
        MeshError: on all ranks: the file cannot be read, groups or elements are missing or unsuitable, or the
            mesh is not the beam of the geometry.

    Collective.
    """
    with gmsh_session(comm):
        groups = on_rank_zero(comm, lambda: _load(Path(path), geometry))
        mesh, _, facets = mesh_from_gmsh(comm, geometry.dimension, lambda: _end(geometry.dimension, groups))
    tagged = TaggedMesh(mesh, facets, groups)
    _check_volume(f"mesh file {path}, group {BODY}", tagged)
    return tagged


def _end(dimension: int, groups: dict[str, int]) -> float:
    """Return the end of the last support, m; on rank 0."""
    from gapbeam.meshes.distributed_mesh import end_of

    return end_of(dimension, groups, tuple(name for name in groups if name not in ENDS))


def _check_volume(where: str, tagged: TaggedMesh) -> None:
    """The cells together are no larger than the box around them. Collective."""
    volume, box = mean_section(tagged, 1.0).volume, float(np.prod(np.subtract(tagged.upper, tagged.lower)))
    if volume > box * (1.0 + TOLERANCE):
        unit = f"m^{tagged.dimension}"
        raise MeshError(
            where,
            found=f"cells of {volume:.4g} {unit} in a box of {box:.4g} {unit}",
            expected="a body that fills every place once",
            hint="Parts overlap, or a part is in the file twice.",
        )


def _load(path: Path, geometry: BeamGeometry) -> dict[str, int]:
    """Load the file into the current gmsh model and check it; returns the tags of its facet groups."""
    import gmsh

    from gapbeam.meshes.user_mesh.frame_check import check_facing
    from gapbeam.meshes.user_mesh.mesh_check import check_elements, check_groups, check_surface
    from gapbeam.meshes.user_mesh.msh_file import load_msh

    where = f"mesh file {path}"
    load_msh(path)
    with gmsh_errors(where, "a mesh that can be used"):
        groups = check_groups(where, geometry)
        nodes, facets = check_elements(where, geometry.dimension, groups)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        points = np.empty((len(tags), 3))
        points[tags.astype(np.int64) - 1] = coordinates.reshape(-1, 3)
        used = {name: points[np.unique(rows)] for name, rows in nodes.items()}
        check_frame(where, geometry, used, used[BODY])
        check_surface(f"{where}, group {BODY}", geometry.dimension, nodes[BODY], facets, points)
        check_facing(where, geometry, nodes, facets, points)
    return {name: tag for name, tag in groups.items() if name != BODY}
