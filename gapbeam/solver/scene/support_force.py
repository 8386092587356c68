"""Forces and moments of supports on a structure, from the equations of the motions that they hold.

Where D are the motions of all DOFs with unit motions of a held place, the other DOFs u, loads f on the held motions and
a support that moves by d s give

    R = D^T (K u + M u'') + D^T K d s + D^T M d s'' - D^T f.

Weight and base motions act on held motions by the inertia M r that they carry, other loads do not. Damping by ratios of
modes acts on no held motion. Over a step of the midpoint rule, R is the mean over the step, as contact forces are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.system.operators import Array

HELD = 6
"""Components of a support: forces along x, y and z, and moments about them."""


class SupportForce(NamedTuple):
    """The force and moment of a support on its structure, (6,), as rows of DOFs.

    Attributes:
        stiffness: D^T K, (6, DOFs).
        mass: D^T M, (6, DOFs).
        inertia: D^T M r for motions r of the frame along x, y and z, (6, 3), kg and kg m.
        driven: D^T K d and D^T M d of supports that move along x, y and z, (6, 3), by their points; see `driven_rows`.
    """

    stiffness: Array
    mass: Array
    inertia: Array
    driven: Mapping[str, Array]

    def over(self, basis: Array) -> SupportForce:
        """Return the force for DOFs basis @ q."""
        return self._replace(stiffness=self.stiffness @ basis, mass=self.mass @ basis)


def support_force(
    D: Array, matrices: Mapping[str, Any], inertia: Any, driven: Mapping[str, Array], kept: Callable[[Array], Any]
) -> SupportForce:
    """Return the force of a support.

    Args:
        D: Motions of all DOFs with unit motions of the place where it holds them, else 0, (all DOFs, 6).
        matrices: K and M of all DOFs, by letter.
        inertia: M r of all DOFs for the frame along x, y and z, (all DOFs, 3).
        driven: Motions of all DOFs with supports that loads move, (all DOFs, 3), by name.
        kept: Returns the part of rows that belongs to the DOFs of the structure.
    """
    K, M = (np.asarray(matrices[letter] @ D).T for letter in "KM")
    moved = {f"{name}: {letter}": rows @ d for name, d in driven.items() for letter, rows in (("K", K), ("M", M))}
    return SupportForce(np.asarray(kept(K)), np.asarray(kept(M)), D.T @ inertia, moved)
