"""A dense system with masses on springs beside it, which nothing but contact couples to it.

    M = diag(M_beam, m_1, m_2, ...),    K = diag(K_beam, k_1, k_2, ...)

The DOFs of the masses come after those of the beam.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array


class MassesBeside(DenseOperators):
    """M and K of a dense system and of masses on springs to the frame.

    Args:
        beam: The system without them.
        masses: m, (k,), kg.
        springs: k, (k,), N/m.
    """

    def __init__(self, beam: DenseOperators, masses: Array, springs: Array) -> None:
        super().__init__(
            block_diag(beam.mass, np.diag(masses)),
            np.zeros((beam.size + len(masses),) * 2),
            block_diag(beam.restraint, np.zeros((len(masses),) * 2)),
        )
        self.stiffness = block_diag(beam.stiffness, np.diag(springs))  # that of the beam to the last bit
        self._beam, self._masses, self._springs = beam, masses, springs

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Those of the beam, and each mass on its spring: a stiff spring leaves no round-off in the others."""
        squares, shapes = self._beam.modes
        alone = np.diag(1.0 / np.sqrt(self._masses))
        return np.concatenate([squares, self._springs / self._masses]), block_diag(shapes, alone)
