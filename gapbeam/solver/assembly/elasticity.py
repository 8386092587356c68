"""Isotropic linear elasticity in 3D, plane stress and plane strain: the weak forms.

    a(u, v) = int sigma(u) : eps(v),   m(u, v) = int rho u . v,   r(u, v) = int_faces k_t u_t . v_t

In 2D every form carries the width of the beam, so that forces are whole forces in N.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh

from gapbeam.solver.assembly.cell_stiffness import CellStiffness
from gapbeam.solver.assembly.cell_values import constant, in_cells, value_in_cells
from gapbeam.solver.case.beam_profile import BeamProfile
from gapbeam.solver.case.case import Material


@dataclass(frozen=True)
class ElasticForms:
    """Bilinear forms on a vector space.

    Attributes:
        mass: m (UFL).
        stiffness: a, cell by cell.
        restraint: r (UFL).
    """

    mass: Any
    stiffness: CellStiffness
    restraint: Any


def lame(material: Material, plane_stress: bool) -> tuple[float, float]:
    """Return (lambda, mu), Pa; lambda is the reduced 2 lambda mu / (lambda + 2 mu) in plane stress."""
    E, nu = material.young_modulus, material.poisson_ratio
    mu = E / (2.0 * (1.0 + nu))
    full = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return (2.0 * full * mu / (full + 2.0 * mu) if plane_stress else full), mu


def stress(u: Any, material: Material, plane_stress: bool) -> Any:
    """Return sigma(u) = lambda tr(eps) I + 2 mu eps (UFL), Pa; in plane."""
    first, second = lame(material, plane_stress)
    strain = ufl.sym(ufl.grad(u))
    return first * ufl.tr(strain) * ufl.Identity(len(u)) + 2.0 * second * strain


def density_of(mesh: Mesh, profile: BeamProfile) -> Any:
    """Return the density of a beam for the forms on its mesh, kg/m^3. Collective."""
    return value_in_cells(mesh, profile, lambda piece: piece.material.density)


def elastic_forms(
    space: fem.FunctionSpace,
    profile: BeamProfile,
    plane_stress: bool,
    width: float,
    restraint: tuple[float, float],
    face_measure: Any,
) -> ElasticForms:
    """Return the forms of a beam.

    Args:
        space: Vector Lagrange space.
        profile: Elastic constants and density along the beam.
        plane_stress: 2D assumption; no meaning in 3D.
        width: Factor of all forms: the width in 2D, 1 in 3D, m.
        restraint: Tangential stiffness per area along x and across the width, Pa/m.
        face_measure: UFL measure of base and gland together.
    """
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    domain = space.mesh
    dimension = domain.geometry.dim
    plane = plane_stress and dimension == 2
    scale = constant(domain, width)
    first = in_cells(domain, profile, lambda piece: lame(piece.material, plane)[0])
    second = in_cells(domain, profile, lambda piece: lame(piece.material, plane)[1])
    tangential = sum(
        constant(domain, stiffness) * u[axis] * v[axis] for axis, stiffness in enumerate(restraint[: dimension - 1])
    )
    return ElasticForms(
        mass=scale * density_of(domain, profile) * ufl.inner(u, v) * ufl.dx,
        stiffness=CellStiffness(space, first, second, width),
        restraint=scale * tangential * face_measure,
    )
