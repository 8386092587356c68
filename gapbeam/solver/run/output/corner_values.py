"""Motion at the corners of the cells, which field files hold without the other nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from scipy.sparse import issparse

from gapbeam.solver.models.model import Model
from gapbeam.solver.system.operators import Array, Indices, row_product


@dataclass(frozen=True)
class CornerValues:
    """Values at the corners that this rank owns, taken from the DOFs that are marched.

    A corner of a cell is a node of the space of the displacement, so its values are DOFs: nothing is interpolated. Of a
    reduced model only the rows of the corners are expanded.

    Attributes:
        rows: DOFs of the mesh at the corners, among those that this rank owns, (n d,).
        components: d, of the displacement.
        expansion: These rows of the expansion of the model, transposed, (k, n d); None: the mesh is marched.
    """

    rows: Indices
    components: int
    expansion: Any

    @classmethod
    def of_model(cls, model: Model, linear: Any) -> CornerValues:
        """Return the corner values of a model.

        Args:
            model: The model.
            linear: Blocked linear Lagrange space on the same mesh, whose nodes are the corners.

        Collective.
        """
        fine, coarse = fem.Function(model.space), fem.Function(linear)
        block, owned = linear.dofmap.index_map_bs, linear.dofmap.index_map.size_local
        fine.x.array[:] = np.arange(len(fine.x.array))
        coarse.interpolate(fine)  # the number of the node that lies there
        rows = np.rint(coarse.x.array[: owned * block]).astype(np.int64)
        assert np.all(rows < model.space.dofmap.index_map.size_local * block), "a rank owns a corner, not its node"
        expansion = model.body.expansion
        if expansion is None:
            return cls(rows, block, None)
        taken = expansion[rows].T
        return cls(rows, block, taken if issparse(taken) else np.ascontiguousarray(taken))

    def vectors(self, marched: Array) -> Array:
        """Return vectors in space, (times, n, 3).

        Args:
            marched: DOFs that are marched, of which those of the beam come first, (times, DOFs).
        """
        if self.expansion is None:
            values = marched[:, self.rows]
        elif issparse(self.expansion):
            values = np.stack([one[: self.expansion.shape[0]] @ self.expansion for one in marched])
        else:
            values = row_product(marched[:, : len(self.expansion)], self.expansion)
        shaped = values.reshape(len(marched), -1, self.components)
        return np.pad(shaped, ((0, 0), (0, 0), (0, 3 - self.components))) if self.components < 3 else shaped
