"""Isotropic linear elasticity in 3D, plane stress and plane strain: mass, stiffness and restraint, cell by cell.

    a(u, v) = int sigma(u) : eps(v),   m(u, v) = int rho u . v,   r(u, v) = int_faces k_t u_t . v_t

In 2D every part carries the width of the beam, so that forces are whole forces in N.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.assembly.cell_stiffness import CellMass, CellStiffness, FacetSprings
from gapbeam.solver.assembly.cell_values import in_cells
from gapbeam.solver.case.beam_profile import BeamProfile
from gapbeam.solver.case.case import Material
from gapbeam.solver.system.operators import Indices


@dataclass(frozen=True)
class ElasticParts:
    """Bilinear forms on a vector space.

    Attributes:
        mass: m, cell by cell.
        stiffness: a, likewise.
        restraint: r, facet by facet.
    """

    mass: CellMass
    stiffness: CellStiffness
    restraint: FacetSprings


def lame(material: Material, plane_stress: bool) -> tuple[float, float]:
    """Return (lambda, mu), Pa; lambda is the reduced 2 lambda mu / (lambda + 2 mu) in plane stress."""
    E, nu = material.young_modulus, material.poisson_ratio
    mu = E / (2.0 * (1.0 + nu))
    full = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return (2.0 * full * mu / (full + 2.0 * mu) if plane_stress else full), mu


def elastic_parts(
    space: Any,
    profile: BeamProfile,
    plane_stress: bool,
    width: float,
    restraint: tuple[float, float],
    facets: Indices,
) -> ElasticParts:
    """Return mass, stiffness and restraint of a beam.

    Args:
        space: Vector Lagrange space.
        profile: Elastic constants and density along the beam.
        plane_stress: 2D assumption; no meaning in 3D.
        width: Factor of all integrals: the width in 2D, 1 in 3D, m.
        restraint: Tangential stiffness per area along x and across the width, Pa/m.
        facets: Exterior facets of this rank that are restrained.
    """
    mesh, dimension = space.mesh, space.mesh.geometry.dim
    plane = plane_stress and dimension == 2
    first = in_cells(mesh, profile, lambda piece: lame(piece.material, plane)[0])
    second = in_cells(mesh, profile, lambda piece: lame(piece.material, plane)[1])
    springs = np.array([*restraint[: dimension - 1], 0.0])
    return ElasticParts(
        mass_of(space, profile, width),
        CellStiffness(space, first, second, width),
        FacetSprings(space, facets, springs, width),
    )


def mass_of(space: Any, profile: BeamProfile, width: float) -> CellMass:
    """Return the mass of a beam on a vector Lagrange space; width as in `elastic_parts`."""
    return CellMass(space, in_cells(space.mesh, profile, lambda piece: piece.material.density), width)
