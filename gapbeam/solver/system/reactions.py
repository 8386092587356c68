"""The forces with which joints hold the body, as rows on what a record knows of a state.

    R = A u + B v + F s(t) + P (w p) + T (w t)

Springs and dampers have A and B alone. Where a joint holds a motion that the model has not, the acceleration that the
equation of motion has at the state is put into the equation along that motion (`models.joint_reactions`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.system.operators import Array, Operators
from gapbeam.solver.system.ordered_products import row_product


@dataclass(frozen=True)
class Reactions:
    """Rows for r forces and moments.

    Attributes:
        displacement: A on the DOFs of this rank, (r, n).
        velocity: B, (r, n).
        loads: F, (r, loads).
        pressure: P, (r, m).
        friction: T, (r, m k).
        turning: What forces along y and z at the stations in round holes add, (r, 2k); P is 0 there.
    """

    displacement: Array | csr_matrix
    velocity: Array | csr_matrix
    loads: Array
    pressure: Array
    friction: Array
    turning: Array | None = None

    def of_contact(self, forces: Array, friction: Array | None, turned: Array | None = None) -> Array:
        """Return the part of contact, (r,), N and N m.

        Args:
            forces: w p, (m,), N.
            friction: w t, (m, k), N; None: nothing rubs.
            turned: Forces along y and z at the stations in round holes, (2k,), N; None: there are none.
        """
        found = np.asarray(self.pressure @ forces)
        if self.turning is not None and turned is not None:
            found = found + self.turning @ turned
        return found if friction is None else np.asarray(found + self.friction @ friction.reshape(-1))

    def total(self, u: Array, v: Array, factors: Array, of_contact: Array, operators: Operators) -> Array:
        """Return the forces on the body, (times, r), N and N m.

        Args:
            u: DOFs of this rank, (times, n).
            v: Their velocities, (times, n).
            factors: s_k, (times, loads).
            of_contact: The part of contact, (times, r).
            operators: They sum over ranks.

        Collective.
        """
        moved = operators.sum(_product(u, self.displacement) + _product(v, self.velocity))
        return np.asarray(moved + row_product(factors, self.loads.T) + of_contact)


def _product(x: Array, rows: Array | csr_matrix) -> Array:
    """Return what rows (r, n) read of vectors (times, n): (times, r), the same bits for any number of times."""
    return row_product(x, rows.T) if isinstance(rows, np.ndarray) else np.ascontiguousarray((rows @ x.T).T)
