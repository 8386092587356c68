"""Products with an operator that are exact for rigid motions.

Elasticity does not feel rigid motions, but the entries of an assembled K do: they are some 1e13 times those of the
inertia that a fine mesh has beside them, and what round-off leaves of K R is then more than M R. With R orthonormal,

    A x = (A R) c + P^T A P x + R (A R)^T P x,    c = R^T x,    P x = x - R c

which is symmetric, and A to round-off, where A R is known better than by the product.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solver.operators import Array

Part = Callable[[Array], Array]


class ExactMotions:
    """A on blocks of columns.

    Args:
        multiply: A with what round-off leaves, (n, k) -> (n, k).
        motions: R, (n, r).
        images: A R, (n, r).
        total: Sums over ranks.

    Collective to use.
    """

    def __init__(self, multiply: Part, motions: Array, images: Array, total: Part) -> None:
        self._multiply, self._motions, self._images, self._total = multiply, motions, images, total

    def __call__(self, x: Array) -> Array:
        """Return A x, (n, k). Collective."""
        share = self._total(np.ascontiguousarray(self._motions.T @ x))
        deformed = x - self._motions @ share
        image = self._multiply(deformed)
        back = self._total(np.ascontiguousarray(self._images.T @ deformed - self._motions.T @ image))
        image += self._images @ share
        image += self._motions @ back
        return image
