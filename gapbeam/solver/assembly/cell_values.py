"""Values of a form that are constant on a mesh, or on each piece of the beam: cells end where pieces do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from dolfinx import default_scalar_type, fem
from dolfinx.mesh import Mesh

from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs
from gapbeam.solver.case.beam_profile import BeamPiece, BeamProfile
from gapbeam.solver.system.operators import Array


def constant(mesh: Mesh, value: float) -> fem.Constant:
    """Return a number as a constant of a form, which is compiled once for all its values."""
    return fem.Constant(mesh, np.array(value, dtype=default_scalar_type))


def value_in_cells(mesh: Mesh, profile: BeamProfile, value: Callable[[BeamPiece], float]) -> Any:
    """Return a value of the pieces of a beam for the forms on its mesh: a constant, or a function of the cells.

    Args:
        mesh: Its cells lie in one piece each.
        profile: The beam along x.
        value: Value of a piece.

    Collective.
    """
    if profile.prismatic:
        return constant(mesh, value(profile.pieces[0]))
    function = fem.Function(fem.functionspace(mesh, ("DG", 0)))
    function.x.array[function.function_space.dofmap.list.reshape(-1)] = in_cells(mesh, profile, value)
    return function


def in_cells(mesh: Mesh, profile: BeamProfile, value: Callable[[BeamPiece], float]) -> Array:
    """Return a value of the pieces of a beam in each cell on this rank, those of other ranks among them, (cells,).

    Args:
        mesh: Its cells lie in one piece each.
        profile: The beam along x.
        value: Value of a piece.
    """
    middles = mesh.geometry.x[coordinate_dofs(mesh), 0].mean(axis=1)
    values = np.array([value(piece) for piece in profile.pieces])
    return np.asarray(values[np.searchsorted(profile.steps, middles)])
