"""The physical groups of a user's mesh: the body and what faces each support have to be there."""

from __future__ import annotations

import difflib

import gmsh

from gapbeam.meshes.beam_geometry import BODY, ENDS, BeamGeometry, contact_faces
from gapbeam.meshes.mesh_errors import MeshError

_KINDS = {0: "points", 1: "curves", 2: "surfaces", 3: "volumes"}


def check_groups(where: str, geometry: BeamGeometry) -> dict[str, int]:
    """Find the groups in the current gmsh model, and remove all that mean nothing to gapbeam.

    Returns:
        Name to tag: body, those of the spans, and end and tip when they are there.

    Raises:
        MeshError: the mesh has another dimension, or groups are missing.
    """
    dimension, faces = geometry.dimension, contact_faces(geometry)
    _check_dimension(where, dimension)
    found = {(dim, gmsh.model.getPhysicalName(dim, tag)): tag for dim, tag in gmsh.model.getPhysicalGroups()}
    wanted = {BODY: dimension, **dict.fromkeys((*faces, *ENDS), dimension - 1)}
    kept = {name: found[dim, name] for name, dim in wanted.items() if (dim, name) in found}
    missing = [name for name in (BODY, *faces) if name not in kept]
    if missing:
        listed = [f'"{name}" ({_KINDS[dim]})' for dim, name in sorted(found) if name]
        unnamed = sum(not name for _, name in found)
        if unnamed:
            listed.append(f"{unnamed} without a name")
        raise MeshError(
            where,
            found=f"the physical groups {', '.join(listed)}" if listed else "no physical groups",
            expected=f"also {' and '.join(f'{name} ({_KINDS[wanted[name]]})' for name in missing)}"
            if listed
            else f"{BODY} ({_KINDS[dimension]}), {_listed(faces)} ({_KINDS[dimension - 1]})",
            hint=" ".join(filter(None, (_near_miss(name, wanted[name], list(found)) for name in missing))),
        )
    useless = [(dim, tag) for (dim, name), tag in found.items() if wanted.get(name) != dim]
    if useless:
        gmsh.model.removePhysicalGroups(useless)
    return kept


def _listed(names: tuple[str, ...]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _check_dimension(where: str, dimension: int) -> None:
    types = gmsh.model.mesh.getElementTypes()
    largest = max((gmsh.model.mesh.getElementProperties(kind)[1] for kind in types), default=0)
    if largest == 0:
        raise MeshError(where, found="no cells", expected="a mesh", hint="In gmsh: mesh first, then save.")
    if largest != dimension:
        raise MeshError(
            where,
            found=f"a mesh of dimension {largest}",
            expected=f"dimension {dimension}, as mesh.dimension says",
            hint="gmsh saves only the elements in physical groups unless Mesh.SaveAll is set."
            if largest < dimension
            else "",
        )


def _near_miss(name: str, dimension: int, found: list[tuple[int, str]]) -> str:
    """Return advice: the group to rename, or the group of the wrong kind."""
    for dim, other in found:
        if other == name:
            return f'"{name}" is a group of {_KINDS[dim]}; it has to be one of {_KINDS[dimension]}.'
    plain = {other.strip().lower(): other for dim, other in reversed(found) if dim == dimension}
    close = difflib.get_close_matches(name, plain, n=1, cutoff=0.7)
    return f'Rename "{plain[close[0]]}" to "{name}".' if close else ""
