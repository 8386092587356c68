"""Materials of solids: isotropic, or orthotropic with own axes, as matrices of Voigt's notation.

With engineering shears, the compliance in the axes of the material is

    S = [ 1/E1, -nu12/E1, -nu13/E1;  ., 1/E2, -nu23/E2;  ., ., 1/E3 ] and diag(1/G23, 1/G13, 1/G12),

and C = T^T S^-1 T in space, where T takes strains to the axes of the material.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, finite, positive
from gapbeam.solver.scene.solid_cells import COMPONENTS, PLANE
from gapbeam.solver.scene.structure_geometry import Pose
from gapbeam.solver.system.operators import Array

Plane = Literal["stress", "strain"]


@dataclass(frozen=True, eq=False)
class OrthotropicMaterial:
    """Linear elasticity with three planes of symmetry.

    Attributes:
        compliance: S in the axes of the material, (6, 6), 1/Pa.
        turn: Columns are these axes in space, (3, 3).
        density: kg/m^3.
    """

    compliance: Array
    turn: Array
    density: float


@checked
def orthotropic(
    young_moduli: Sequence[float],
    poisson_ratios: Sequence[float],
    shear_moduli: Sequence[float],
    density: float,
    axis: Sequence[float] = (1.0, 0.0, 0.0),
    across: Sequence[float] | None = None,
) -> OrthotropicMaterial:
    """Return an orthotropic material.

    Args:
        young_moduli: E1, E2, E3, Pa.
        poisson_ratios: nu12, nu13, nu23: nu12 is the contraction along 2 under tension along 1.
        shear_moduli: G12, G13, G23, Pa.
        density: kg/m^3.
        axis: Direction 1.
        across: Direction 3, at right angles to axis; default z, made to be at right angles.

    Raises:
        UserError: A value is out of range, or the elastic energy of some strain is not positive.
    """
    given = {"young_moduli": young_moduli, "poisson_ratios": poisson_ratios, "shear_moduli": shear_moduli}
    E, nu, G = (_three(value, key) for key, value in given.items())
    heavy = float(positive(density, "orthotropic: density"))
    S = np.diag([*(1.0 / E), 1.0 / G[2], 1.0 / G[1], 1.0 / G[0]])
    for (i, j), ratio in zip(((0, 1), (0, 2), (1, 2)), nu, strict=True):
        S[i, j] = S[j, i] = -ratio / E[i]
    if not np.linalg.eigvalsh(S).min() > 0.0:
        raise ArgumentError(
            f"orthotropic: found poisson_ratios {nu.tolist()} of which some strain has no positive energy, expected "
            "|nu_ij| < sqrt(E_i / E_j) and a positive determinant; perhaps nu21 is given as nu12",
            "poisson_ratios",
        )
    first, third = (None if one is None else tuple(finite(one, "orthotropic")) for one in (axis, across))
    return OrthotropicMaterial(S, Pose((0.0, 0.0, 0.0), first, third).turn, heavy)  # type: ignore[arg-type]


def _three(value: Sequence[float], key: str) -> Array:
    found = finite(value, f"orthotropic: {key}")
    if found.shape != (3,) or (key != "poisson_ratios" and not np.all(found > 0.0)):
        sign = "" if key == "poisson_ratios" else " above 0"
        raise ArgumentError(f"orthotropic: found {key} {found.tolist()}, expected three numbers{sign}", key)
    return found


def moduli(material: Material | OrthotropicMaterial, plane: Plane | None) -> Array:
    """Return the stresses xx, yy, zz, yz, xz, xy of unit strains in space, (6, 6), or in z = constant, (6, 3), Pa."""
    if isinstance(material, Material):
        E, nu = material.young_modulus, material.poisson_ratio
        S = np.diag([1.0 / E] * 3 + [2.0 * (1.0 + nu) / E] * 3)
        S[:3, :3] -= nu / E * (1.0 - np.eye(3))
        T = np.eye(6)
    else:
        S, T = material.compliance, strains_in(material.turn)
    C = np.asarray(T.T @ np.linalg.inv(S) @ T)
    if plane == "stress":
        flat, found = np.linalg.inv(np.linalg.inv(C)[np.ix_(PLANE, PLANE)]), np.zeros((6, len(PLANE)))
        found[list(PLANE)] = 0.5 * (flat + flat.T)
        return found
    C = 0.5 * (C + C.T)
    return C if plane is None else C[:, PLANE]


def strains_in(Q: Array) -> Array:
    """Return T, (6, 6): strains of Voigt's notation in the axes of the columns of Q.

    T^T turns stresses the other way: those in these axes into those outside.
    """
    T = np.zeros((6, 6))
    for k, (i, j) in enumerate(COMPONENTS):
        strain = np.zeros((3, 3))
        strain[i, j] = strain[j, i] = 1.0 if i == j else 0.5
        own = Q.T @ strain @ Q
        T[:, k] = [own[a, b] * (1.0 if a == b else 2.0) for a, b in COMPONENTS]
    return T
