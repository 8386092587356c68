"""A beam between the contact faces of a mesh, of elements that bend in one plane, or in two.

Sections are symmetric about both axes, so bending in the plane and across it do not couple but by contact, loads and
joints: the beam in space is two plane beams with the displacement

    u_x = -z theta - y psi,    u_y = v,    u_z = w

It bends across its plane where something can move it there: a hole, or a load beside the bending axis. Contact acts at
the points of the mesh's contact faces, on v and w there: the section keeps its shape.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from math import pi
from typing import assert_never

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csr_matrix, hstack

from gapbeam.solver.assembly.attached_motions import attached_motions, roll_springs
from gapbeam.solver.assembly.contact_assembly import contact_operator
from gapbeam.solver.attachments.mean_motion import MeanMotion
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_table import BeamModel
from gapbeam.solver.case.symmetry import bends_in_two_planes
from gapbeam.solver.loads.load_directions import axis_point, load_direction
from gapbeam.solver.loads.places import BodyForce, PointForce, SupportAcceleration, SupportWalls
from gapbeam.solver.models.body import Body, MeshedBeam, gathered, point_rule
from gapbeam.solver.models.reduction.held_motions import held
from gapbeam.solver.models.reduction.holds import FloatingBody
from gapbeam.solver.models.reduction.line_points import gathered_points
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.models.reduction.projection import DenseRow, projected
from gapbeam.solver.models.stepped_beam import SteppedBeam
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface
from gapbeam.solver.system.semi_discrete import ContactOperator


@dataclass(frozen=True)
class BeamInPlanes:
    """The plane beams that a beam is made of, their DOFs one after the other.

    Attributes:
        beams: That of the bending plane, and perhaps that across it.
        axes: Component of displacement of each: the last one, and 1.
        dimension: Of displacements, 2 or 3.
    """

    beams: tuple[SteppedBeam, ...]
    axes: tuple[int, ...]
    dimension: int

    @classmethod
    def of_case(cls, case: Case, elements: int) -> BeamInPlanes:
        """Return the beam of a case."""
        dimension = case.mesh.dimension
        vertical = SteppedBeam.of_case(case, elements)
        if not bends_in_two_planes(case):
            return cls((vertical,), (dimension - 1,), dimension)
        return cls((vertical, SteppedBeam.of_case(case, elements, lateral=True)), (dimension - 1, 1), dimension)

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return sum(beam.size for beam in self.beams)

    def operators(self) -> DenseOperators:
        """Return M and K."""
        parts = [beam.operators() for beam in self.beams]
        if len(parts) == 1:
            return parts[0]
        return DenseOperators(*(block_diag(*(getattr(part, name) for part in parts)) for name in ("mass", "stiffness")))

    def across(self, x: Array, directions: Array) -> csr_matrix:
        """Return the motions of the axis along directions at places, (k, n).

        Args:
            x: Places, (k,), m.
            directions: (k, dimension); their component along the beam is left out.
        """
        pairs = zip(self.beams, self.axes, strict=True)
        return csr_matrix(hstack([beam.rows(x)[0].multiply(directions[:, axis, None]) for beam, axis in pairs]))

    def displacement(self, places: Array) -> csr_matrix:
        """Return what gives the displacement at places (k, 3), (k dimension, n)."""
        return csr_matrix(hstack([self._motion(number, places) for number in range(len(self.beams))]))

    def mean_motion(self, motion: MeanMotion) -> Array:
        """Return the row of a motion of a cross-section, (n,)."""
        lateral = motion.name.startswith("lateral")
        found = [np.zeros(beam.size) for beam in self.beams]
        w, theta = self.beams[int(lateral)].rows(np.array([motion.x]))
        found[int(lateral)] = (theta if motion.turns else w).toarray()[0]
        return np.concatenate(found)

    def heave_and_pitch(self) -> Array:
        """Return both rigid motions in the bending plane, (2, n)."""
        motions = self.beams[0].heave_and_pitch()
        return np.pad(motions, ((0, 0), (0, self.size - motions.shape[1])))

    def uniform(self, direction: Array) -> Array:
        """Return the motion of all sections along a direction, (n,)."""
        parts = [
            np.tile([direction[axis], 0.0], beam.elements + 1) for beam, axis in zip(self.beams, self.axes, strict=True)
        ]
        return np.concatenate(parts)

    def _motion(self, number: int, places: Array) -> csr_matrix:
        """Return the displacement at places by one of the plane beams, (k dimension, its size)."""
        beam, axis = self.beams[number], self.axes[number]
        w, theta = beam.rows(places[:, 0])
        along, bending = w.tocoo(), csr_matrix(theta.multiply(-places[:, axis, None])).tocoo()
        rows = np.concatenate([self.dimension * along.row + axis, self.dimension * bending.row])
        entries = np.concatenate([along.data, bending.data]), (rows, np.concatenate([along.col, bending.col]))
        return csr_matrix(entries, (self.dimension * len(places), beam.size))


def beam_body(case: Case, meshed: MeshedBeam, settings: BeamModel) -> Body:
    """Return the body of a case as a beam, whose mesh gives the contact faces and the fields. Collective."""
    started = time.perf_counter()
    beam = BeamInPlanes.of_case(case, settings.elements)
    dimension = case.mesh.dimension
    contact = contact_operator(meshed.space, meshed.faces, case.layout.faces, meshed.width, point_rule(case))
    operators = _restrained(case, beam, contact)
    contact, patch = gathered(case, _on_beam(contact, beam))
    contact = gathered_points(case, contact, True, 1, meshed.facet_length)
    patterns = []
    for load in case.load:
        along = load_direction(load, dimension)
        match load.place:
            case PointForce(point):
                patterns.append(beam.across(axis_point(point)[:1], along[None]).toarray()[0])
            case BodyForce() | SupportAcceleration():
                patterns.append(operators.apply_mass(beam.uniform(along)))
            case SupportWalls():
                patterns.append(np.zeros(operators.size))
            case unknown:
                assert_never(unknown)
    patterns += [beam.mean_motion(one.motion) for one in attached_motions(case)]
    places = meshed.space.tabulate_dof_coordinates()[: meshed.space.dofmap.index_map.size_local]
    body = Body(
        case,
        meshed,
        operators,
        contact,
        tuple(patterns),
        {probe.name: DenseRow(beam.displacement(axis_point(probe.point)[None]).toarray()) for probe in case.probe},
        np.stack([operators.apply_mass(motion) for motion in beam.heave_and_pitch()]),
        patch=patch,
        expansion=beam.displacement(places),
        seconds={"mesh": meshed.seconds, "assembly": time.perf_counter() - started},
    )
    if not any(one.held for one in attached_motions(case)):
        return body
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    floating = modal_basis(operators, np.identity(beam.size), shift)
    basis = held(body, floating, shift)
    holding = FloatingBody(body, floating, shift).holding_shapes(contact, basis)
    return replace(projected(body, contact, basis), holding=holding)


def _restrained(case: Case, beam: BeamInPlanes, contact: ContactOperator) -> DenseOperators:
    """Return M and K, with the lateral restraint over flat faces where the beam bends across its plane."""
    operators = beam.operators()
    if len(beam.beams) == 1 or roll_springs(case):
        return operators
    sideways = np.tile(np.identity(beam.dimension)[1], (contact.size, 1))
    rows = beam.across(contact.positions[:, 0], sideways)
    spread = case.restraint.lateral / contact.area * contact.weights
    return DenseOperators(operators.mass, operators.stiffness, (rows.T @ rows.multiply(spread[:, None])).toarray())


def _on_beam(contact: ContactOperator, beam: BeamInPlanes) -> ContactOperator:
    """Return the operator at the same points of the faces, on the DOFs of the beam."""
    opening = contact.support.opening(contact.faces, contact.positions[:, : beam.dimension])
    everywhere = np.arange(beam.size)
    gap = beam.across(contact.positions[:, 0], opening)
    return replace(contact, interface=Interface(beam.size, everywhere, everywhere), gap_matrix=gap)
