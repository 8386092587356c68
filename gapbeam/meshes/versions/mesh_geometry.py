"""The coordinates of a DOLFINx mesh under their names in 0.9 and 0.11."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh


def coordinate_element(mesh: Mesh) -> Any:
    """Map from the reference cell to the cells; 0.11 warns about the name that 0.9 knows."""
    geometry = mesh.geometry
    return geometry.cmaps[0] if hasattr(geometry, "cmaps") else geometry.cmap


def coordinate_dofs(mesh: Mesh) -> npt.NDArray[np.int32]:
    """Rows of `mesh.geometry.x` of each cell; 0.11 warns about the name that 0.9 knows."""
    geometry = mesh.geometry
    return np.asarray(geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap)


def geometry_order(mesh: Mesh) -> int:
    """Polynomial order of the cells' shape."""
    return int(coordinate_element(mesh).degree)
