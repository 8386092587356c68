"""Values that are constant on each piece of the beam: cells end where pieces do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs
from gapbeam.solver.case.beam_profile import BeamPiece, BeamProfile
from gapbeam.solver.system.operators import Array


def in_cells(mesh: Any, profile: BeamProfile, value: Callable[[BeamPiece], float]) -> Array:
    """Return a value of the pieces of a beam in each cell on this rank, those of other ranks among them, (cells,).

    Args:
        mesh: Its cells lie in one piece each.
        profile: The beam along x.
        value: Value of a piece.
    """
    middles = mesh.geometry.x[coordinate_dofs(mesh), 0].mean(axis=1)
    values = np.array([value(piece) for piece in profile.pieces])
    return np.asarray(values[np.searchsorted(profile.steps, middles)])
