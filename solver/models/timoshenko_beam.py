"""Timoshenko beam elements between the contact faces of a mesh.

    V = 1/2 int E I theta'^2 + kappa G A (w' - theta)^2 dx,    T = 1/2 int rho A w_t^2 + rho I theta_t^2 dx

in bending alone, with w along the bending axis and u_x = -z theta. The elements interpolate what a beam without load
between its nodes takes exactly, so that they do not lock. Contact acts at the points of the mesh's contact faces, on w
there: the thickness does not change. In plane strain E / (1 - nu^2) stands in the place of E.

Source: Friedman and Kosmatka (1993) for the element; area, I and kappa are those of the cross-section.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from math import pi
from typing import assert_never

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.attached_motions import attached_motions
from gapbeam.solver.assembly.contact_assembly import contact_operator
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_table import BeamModel
from gapbeam.solver.loads.load_directions import axis_point, load_direction
from gapbeam.solver.loads.places import BodyForce, PointForce, SupportAcceleration
from gapbeam.solver.models.body import Body, MeshedBeam, gathered, point_rule
from gapbeam.solver.models.reduction.held_motions import held
from gapbeam.solver.models.reduction.line_points import gathered_points
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.models.reduction.projection import DenseRow, projected
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface
from gapbeam.solver.system.semi_discrete import ContactOperator

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact for products of the cubic shapes


@dataclass(frozen=True)
class TimoshenkoBeam:
    """A beam of equal elements; DOFs w, theta of one node after the other.

    Attributes:
        length: m.
        elements: Number of elements.
        bending: E I, N m^2.
        shear: kappa G A, N.
        mass: rho A, kg/m.
        inertia: rho I, kg m.
    """

    length: float
    elements: int
    bending: float
    shear: float
    mass: float
    inertia: float

    @classmethod
    def of_case(cls, case: Case, elements: int) -> TimoshenkoBeam:
        """Return the beam of a case."""
        beam, material = case.beam, case.material
        area, second = beam.area, beam.second_moment
        young, poisson = material.young_modulus, material.poisson_ratio
        kappa = beam.shear_coefficient(poisson)
        stiffened = young / (1.0 - poisson**2) if case.mesh.dimension == 2 and case.mesh.plane == "strain" else young
        return cls(
            length=beam.length,
            elements=elements,
            bending=stiffened * second,
            shear=kappa * young / (2.0 * (1.0 + poisson)) * area,
            mass=material.density * area,
            inertia=material.density * second,
        )

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return 2 * (self.elements + 1)

    def rows(self, x: Array) -> tuple[csr_matrix, csr_matrix]:
        """Return what gives w and theta at places, (k, n) each."""
        element = self.length / self.elements
        which = np.clip(np.floor(x / element).astype(int), 0, self.elements - 1)
        w, theta, _, _ = self._shapes(x / element - which)
        columns = 2 * which[:, None] + np.arange(4)
        places = (np.repeat(np.arange(len(x)), 4), columns.reshape(-1))
        shape = (len(x), self.size)
        return csr_matrix((w.reshape(-1), places), shape), csr_matrix((theta.reshape(-1), places), shape)

    def heave_and_pitch(self) -> Array:
        """Return both rigid motions, (2, n): w = 1, and w = x with theta = 1."""
        places = np.linspace(0.0, self.length, self.elements + 1)
        ones, zeros = np.ones_like(places), np.zeros_like(places)
        return np.stack([np.stack(pair, axis=1).reshape(-1) for pair in ((ones, zeros), (places, ones))])

    def operators(self) -> DenseOperators:
        """Return M and K."""
        length = self.length / self.elements
        w, theta, slope, curvature = self._shapes(0.5 * (1.0 + POINTS))
        factors = 0.5 * length * WEIGHTS[:, None]
        strain = slope - theta
        stiffness = curvature.T @ (self.bending * factors * curvature) + strain.T @ (self.shear * factors * strain)
        mass = w.T @ (self.mass * factors * w) + theta.T @ (self.inertia * factors * theta)
        whole_mass, whole_stiffness = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        for first in range(0, 2 * self.elements, 2):
            here = slice(first, first + 4)
            whole_mass[here, here] += mass
            whole_stiffness[here, here] += stiffness
        return DenseOperators(whole_mass, whole_stiffness)

    def _shapes(self, xi: Array) -> tuple[Array, Array, Array, Array]:
        """Return shapes of w, theta, w' and theta' at xi in [0, 1] of an element, (k, 4) each."""
        length = self.length / self.elements
        phi = 12.0 * self.bending / (self.shear * length**2)
        share, one = 1.0 / (1.0 + phi), np.ones_like(xi)
        w = share * np.stack(
            [
                2.0 * xi**3 - 3.0 * xi**2 - phi * xi + (1.0 + phi),
                length * (xi**3 - (2.0 + 0.5 * phi) * xi**2 + (1.0 + 0.5 * phi) * xi),
                -2.0 * xi**3 + 3.0 * xi**2 + phi * xi,
                length * (xi**3 - (1.0 - 0.5 * phi) * xi**2 - 0.5 * phi * xi),
            ],
            axis=1,
        )
        slope = (share / length) * np.stack(
            [
                6.0 * xi**2 - 6.0 * xi - phi,
                length * (3.0 * xi**2 - (4.0 + phi) * xi + (1.0 + 0.5 * phi)),
                -6.0 * xi**2 + 6.0 * xi + phi,
                length * (3.0 * xi**2 - (2.0 - phi) * xi - 0.5 * phi),
            ],
            axis=1,
        )
        theta = share * np.stack(
            [
                6.0 * (xi**2 - xi) / length,
                3.0 * xi**2 - (4.0 + phi) * xi + (1.0 + phi),
                -6.0 * (xi**2 - xi) / length,
                3.0 * xi**2 - (2.0 - phi) * xi,
            ],
            axis=1,
        )
        curvature = (share / length) * np.stack(
            [
                6.0 * (2.0 * xi - one) / length,
                6.0 * xi - (4.0 + phi),
                -6.0 * (2.0 * xi - one) / length,
                6.0 * xi - (2.0 - phi),
            ],
            axis=1,
        )
        return w, theta, slope, curvature


def beam_body(case: Case, meshed: MeshedBeam, settings: BeamModel) -> Body:
    """Return the body of a case as a beam, whose mesh gives the contact faces and the fields. Collective."""
    started = time.perf_counter()
    beam = TimoshenkoBeam.of_case(case, settings.elements)
    operators, dimension = beam.operators(), case.mesh.dimension
    contact = contact_operator(meshed.space, meshed.faces, case.layout.faces, meshed.width, point_rule(case))
    contact, patch = gathered(case, _on_beam(contact, beam))
    contact = gathered_points(case, contact, True, 1, meshed.facet_length)
    patterns = []
    for load in case.load:
        along = load_direction(load, dimension)[-1]
        match load.place:
            case PointForce(point):
                w, _ = beam.rows(axis_point(point)[:1])
                patterns.append(along * w.toarray()[0])
            case BodyForce() | SupportAcceleration():
                patterns.append(along * operators.apply_mass(np.tile([1.0, 0.0], beam.elements + 1)))
            case unknown:
                assert_never(unknown)
    for one in attached_motions(case):
        w, theta = beam.rows(np.array([one.motion.x]))
        patterns.append((theta if one.motion.turns else w).toarray()[0])
    places = meshed.space.tabulate_dof_coordinates()[: meshed.space.dofmap.index_map.size_local]
    body = Body(
        case,
        meshed,
        operators,
        contact,
        tuple(patterns),
        {
            probe.name: DenseRow(_motion(beam, axis_point(probe.point)[None], dimension).toarray())
            for probe in case.probe
        },
        np.stack([operators.apply_mass(motion) for motion in beam.heave_and_pitch()]),
        patch=patch,
        expansion=_motion(beam, places, dimension),
        seconds={"mesh": meshed.seconds, "assembly": time.perf_counter() - started},
    )
    if not any(one.held for one in attached_motions(case)):
        return body
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    return projected(body, contact, held(body, modal_basis(operators, np.identity(beam.size), shift), shift))


def _on_beam(contact: ContactOperator, beam: TimoshenkoBeam) -> ContactOperator:
    """Return the operator at the same points of the faces, on the DOFs of the beam."""
    w, _ = beam.rows(contact.positions[:, 0])
    everywhere = np.arange(beam.size)
    gap = csr_matrix(w.multiply(contact.upward[:, None]))
    return replace(contact, interface=Interface(beam.size, everywhere, everywhere), gap_matrix=gap)


def _motion(beam: TimoshenkoBeam, places: Array, dimension: int) -> csr_matrix:
    """Return what gives the displacement at places (k, 3), (k dimension, n)."""
    w, theta = beam.rows(places[:, 0])
    along, bending = w.tocoo(), csr_matrix(theta.multiply(-places[:, dimension - 1, None])).tocoo()
    rows = np.concatenate([dimension * along.row + dimension - 1, dimension * bending.row])
    entries = np.concatenate([along.data, bending.data]), (rows, np.concatenate([along.col, bending.col]))
    return csr_matrix(entries, (dimension * len(places), beam.size))
