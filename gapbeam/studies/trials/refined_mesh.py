"""The keys of a mesh with cells of another size, in the plane or solid."""

from __future__ import annotations

from typing import Any

from gapbeam.solver.case.case import Case, Mesh


def mesh_keys(case: Case, refinement: float, in_plane: bool = False, even: bool = False) -> dict[str, Any]:
    """Return the keys of a mesh with cells of another size, for `read_case`; None removes a key.

    Args:
        case: The case; gapbeam builds its mesh.
        refinement: Size of the new cells relative to those of the case.
        in_plane: Mesh a slice in the bending plane, whatever the dimension of the case.
        even: Even numbers of cells, which put nodes of degree 1 on the axis.
    """
    mesh, profile = case.mesh, case.profile
    thickness = profile.thickest if refinement > 1.0 else profile.thinnest  # coarser, or finer, everywhere
    plane = in_plane or mesh.dimension == 2
    size, support = mesh.size or thickness, mesh.support_size or thickness / 3.0
    near = min(support * refinement, case.layout.shortest or case.beam.length)
    changes: dict[str, Any] = {
        "mesh.dimension": 2 if plane else 3,
        "mesh.size": min(size * refinement, case.beam.length),
        "mesh.support_size": near,
        "mesh.edge_size": None if mesh.edge_size is None else min(mesh.edge_size * refinement, near),
        "mesh.cells_through_thickness": _cells(mesh.cells_through_thickness, refinement, even),
        "mesh.cells_across_width": None if plane else _cells(mesh.cells_across_width, refinement, even),
    }
    if plane and mesh.dimension == 3:
        changes["mesh.cell"] = Mesh().cell
    return changes


def _cells(count: int | None, refinement: float, even: bool) -> int:
    wanted = (count or 4) / refinement
    return max(2, 2 * round(0.5 * wanted)) if even else max(1, round(wanted))
