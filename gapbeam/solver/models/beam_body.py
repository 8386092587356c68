"""A beam between the contact faces of a mesh: elements that bend, lengthen and twist as their case asks for, or rigid.

What moves is decided by `case.beam_motions`. Contact acts at the points of the mesh's contact faces, on the motion of
these points with their sections, and so does friction, which acts at the surface and turns the section.

A rigid body as the one part of a beam: its DOFs are the motions of its section in the middle of the beam.

As in multibody programs, a rigid body has

    M = int rho V^T V dV,    u = V q

with the three motions of the plane, or all six. The integral is over the cells of the mesh; contact, loads and probes
are those of the points of the beam.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, pi
from typing import ClassVar, assert_never

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import block_diag, csr_matrix, hstack, vstack

from gapbeam.meshes.tagged_mesh import cell_points
from gapbeam.meshes.versions.mesh_geometry import geometry_order
from gapbeam.solver.assembly.assembled_system import acting_rows, attached_motions
from gapbeam.solver.assembly.contact_assembly import contact_operator
from gapbeam.solver.assembly.elasticity import in_cells
from gapbeam.solver.assembly.gauss_rule import stations_along
from gapbeam.solver.case.analysis_table import NAMES, RigidMotion, unit_motions
from gapbeam.solver.case.beam_motions import axial_restraint, beam_motions, is_symmetric, lateral_restraint
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_choice import highest_frequency
from gapbeam.solver.case.solution_tables import BeamModel, BeamMotion
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator, StationOperator
from gapbeam.solver.loads.attachments import IN_PLANE, MeanMotion, MotionName
from gapbeam.solver.loads.load_choice import axis_point, load_direction
from gapbeam.solver.loads.places import BodyForce, LineForce, PointForce, SupportAcceleration, SupportWalls, patterned
from gapbeam.solver.models.body import TURNED, Body, MeshedBeam, gathered, point_rule
from gapbeam.solver.models.contact_setting import met_along_lines
from gapbeam.solver.models.elastic_rod import ElasticRod
from gapbeam.solver.models.reduction.contact_lines import along_elements, gathered_points, points_around, support_parts
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.models.reduction.projection import (
    DenseRow,
    held,
    held_rows,
    holding_shapes,
    moved,
    projected,
    spanned,
)
from gapbeam.solver.models.reduction.span_basis import MODES_ABOVE, cut_nodes, free_motions, span_basis, wave_count
from gapbeam.solver.models.timoshenko_beam import AxialPart, BeamPart, BendingPart, SteppedBeam, TorsionPart
from gapbeam.solver.supports.support import along_faces
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array, Indices, Interface
from gapbeam.solver.system.semi_discrete import ContactOperator

EXACT = {1: 6, 2: 10}  # degree of quadrature of squares of coordinates, by the order of the cells


@dataclass(frozen=True)
class RigidPart:
    """All motions of a rigid body.

    Attributes:
        middle: Place along the beam of the section whose motions are the DOFs, m.
        dimension: Dimension of displacements, 2 or 3.
        mass: M, (size, size).
        centroid: Returns (y, z) of the centroid of the cross-section at x, m.
    """

    middle: float
    dimension: int
    mass: Array
    centroid: Callable[[float], tuple[float, float]]

    @classmethod
    def of_case(cls, case: Case, meshed: MeshedBeam) -> RigidPart:
        """Return the part of a case, whose mass is that of its cells. Collective."""
        mesh, middle, dimension = meshed.tagged.mesh, 0.5 * case.beam.length, case.mesh.dimension
        massless = cls(middle, dimension, np.empty((0, 0)), _centroid(case, meshed))
        owned = mesh.topology.index_map(dimension).size_local
        density = in_cells(mesh, case.profile, lambda piece: piece.material.density)[:owned]
        mass = np.zeros((massless.size, massless.size))
        for volume, places in cell_points(mesh, EXACT[geometry_order(mesh)]):
            moved = massless._at(places)
            mass += np.einsum("c,cik,cjk->ij", meshed.width * density * volume, moved, moved, optimize=True)
        mass = np.asarray(sum(mesh.comm.allgather(mass)))
        return cls(middle, dimension, 0.5 * (mass + mass.T), massless.centroid)

    @property
    def names(self) -> tuple[MotionName, ...]:
        """The motions."""
        return NAMES if self.dimension == 3 else IN_PLANE

    nodal: ClassVar[int] = 0  # no DOFs belong to a node

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return len(self.names)

    @cached_property
    def _motions(self) -> tuple[RigidMotion, ...]:
        about = [
            RigidMotion.about((self.middle, 0.0, 0.0), one.translation, one.rotation)
            for name, one in zip(NAMES, unit_motions(), strict=True)
            if name in self.names
        ]
        return tuple(about)

    def _at(self, places: Array) -> Array:
        """Return the motions of points, (k, size, dimension)."""
        axes = [0, 1, 2] if self.dimension == 3 else [0, 2]
        inside = np.zeros((len(places), 3))
        inside[:, axes] = places[:, : self.dimension]
        return np.stack([motion.at(inside)[:, axes] for motion in self._motions], axis=1)

    def operators(self) -> SparseOperators:
        """Return M and K = 0."""
        return SparseOperators(csr_matrix(self.mass), csr_matrix(self.mass.shape))

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return the motion of points along directions, (k, size)."""
        return csr_matrix(np.einsum("kid,kd->ki", self._at(places), directions))

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (k dimension, size)."""
        return csr_matrix(self._at(places).transpose(0, 2, 1).reshape(-1, self.size))

    def section_motion(self, x: float, name: MotionName) -> Array | None:
        """Return the row of a motion of the cross-section at a place, (size,); None: the body has no such motion."""
        if name not in self.names:
            return None
        motion = MeanMotion(x, name)
        if motion.turns:
            return np.asarray(np.array(self.names) == name, dtype=float)
        beside, above = self.centroid(x)
        center = np.array([[x, beside, above]]) if self.dimension == 3 else np.array([[x, above, 0.0]])
        return np.asarray(self._at(center)[0] @ motion.direction(self.dimension))

    def uniform(self, direction: Array) -> Array:
        """Return the motion of all points by a vector, (size,)."""
        return np.asarray(self._at(np.array([[self.middle, 0.0, 0.0]]))[0] @ direction)

    def rigid_motions(self) -> dict[MotionName, Array]:
        """Return the rigid motions by the motions of the section at x = 0, (size,) each."""
        found = dict[MotionName, Array]()
        for name, motion in zip(NAMES, unit_motions(), strict=True):
            if name in self.names:
                moved = motion.section(self.middle)
                found[name] = np.array([moved[own] for own in self.names])
        return found


def _centroid(case: Case, meshed: MeshedBeam) -> Callable[[float], tuple[float, float]]:
    """Return the function to the centroids of cross-sections: those of the sections, or of a mesh file."""
    if case.mesh.file is None:
        return lambda x: case.profile.at(x).beam.centroid
    from gapbeam.solver.assembly.section_cut import SectionCutter

    cutter = SectionCutter(meshed.space)

    def cut(x: float) -> tuple[float, float]:
        moments = cutter.cut(x, "a joint, a mass, a fluid or a restraint").moments
        center = moments[0, 1:] / moments[0, 0]
        return (0.0, float(center[0])) if len(center) == 1 else (float(center[0]), float(center[1]))

    return cut


WAVES_IN_SPAN = 4  # half waves in a span of the basis
LONGEST_SPAN = 500  # elements


@dataclass(frozen=True)
class BeamOfParts:
    """The motions of a beam, their DOFs one after the other.

    Attributes:
        parts: Bending in its plane and other motions that the case asks for, or those of a rigid body.
        motions: The names of all.
        dimension: Dimension of displacements, 2 or 3.
        neutral: Height of the centroid above the axis, m, where axial motions are those of the centroid.
    """

    parts: tuple[BeamPart, ...]
    motions: tuple[BeamMotion, ...]
    dimension: int
    neutral: float = 0.0

    @classmethod
    def of_case(cls, case: Case, elements: int, graded: bool = False) -> BeamOfParts:
        """Return the beam of a case with so many elements along it, equal or graded ones."""
        dimension, motions = case.mesh.dimension, tuple(beam_motions(case))
        upright = SteppedBeam.of_case(case, elements, graded=graded)
        bending = BendingPart(upright, dimension - 1, dimension, ("vertical", "rotation"))

        def part(name: BeamMotion) -> BeamPart:
            match name:
                case "bending":
                    return bending
                case "lateral":
                    across = SteppedBeam.of_case(case, elements, lateral=True, graded=graded)
                    return BendingPart(across, 1, dimension, ("lateral", "lateral_rotation"))
                case "axial":
                    return AxialPart(ElasticRod.of_case(case, upright.places, twists=False), dimension)
                case "torsion":
                    return TorsionPart(ElasticRod.of_case(case, upright.places, twists=True))
                case unknown:
                    assert_never(unknown)

        others = [part(name) for name in motions if name != "bending"]
        return cls((bending, *others), motions, dimension, upright.neutral)

    @classmethod
    def rigid(cls, case: Case, meshed: MeshedBeam) -> BeamOfParts:
        """Return the rigid beam of a case. Collective."""
        motions: tuple[BeamMotion, ...] = ("bending", "axial")
        if case.mesh.dimension == 3:
            motions = (*motions, "lateral", "torsion")
        return cls((RigidPart.of_case(case, meshed),), motions, case.mesh.dimension)

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return sum(part.size for part in self.parts)

    def at_nodes(self, nodes: Indices) -> Indices:
        """Return the DOFs at nodes; rods have some between nodes, too."""
        firsts = np.cumsum([0, *(part.size for part in self.parts)])
        pairs = zip(self.parts, firsts, strict=False)
        own = [first + 2 * nodes + turns for part, first in pairs for turns in range(part.nodal)]
        return np.concatenate(own)

    def operators(self) -> SparseOperators:
        """Return M and K."""
        parts = [part.operators() for part in self.parts]
        if len(parts) == 1:
            return parts[0]
        mass, stiffness = (block_diag([getattr(part, name) for part in parts]) for name in ("mass", "stiffness"))
        return SparseOperators(csr_matrix(mass), csr_matrix(stiffness))

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return the motions of points of the beam along directions, (k, n).

        Args:
            places: The points, (k, 3), m.
            directions: (k, dimension).
        """
        return csr_matrix(hstack([part.along(places, directions) for part in self.parts]))

    def displacement(self, places: Array) -> csr_matrix:
        """Return the matrix of the displacement at places (k, 3), (k dimension, n)."""
        return csr_matrix(hstack([part.displacement(places) for part in self.parts]))

    def mean_motion(self, motion: MeanMotion) -> Array:
        """Return the row of a motion of a cross-section, or of a point that the section carries, (n,)."""
        (_, own), *carried = motion.parts()
        found = self._section_motion(own)
        for arm, part in carried:
            found = found + arm * self._section_motion(part)
        return found

    def turn(self, x: float, dimension: int) -> Array:
        """Return the rotation of the section at x in the bending plane, the last of so many rows, (dimension, n)."""
        row = self.mean_motion(MeanMotion(x, "rotation"))
        return np.vstack([np.zeros((dimension - 1, len(row))), row])

    def _section_motion(self, motion: MeanMotion) -> Array:
        found = [part.section_motion(motion.x, motion.name) for part in self.parts]
        pairs = zip(self.parts, found, strict=True)
        return np.concatenate([np.zeros(part.size) if row is None else row for part, row in pairs])

    def rigid_motions(self) -> Array:
        """Return the six rigid motions, (6, n); those that the beam has not are 0."""
        found, first = np.zeros((len(NAMES), self.size)), 0
        for part in self.parts:
            for name, row in part.rigid_motions().items():
                found[NAMES.index(name), first : first + part.size] += row
                if name == "axial":  # of the centroid, in a rotation about the axis
                    found[NAMES.index("rotation"), first : first + part.size] -= self.neutral * row
            first += part.size
        return found

    def uniform(self, direction: Array) -> Array:
        """Return the motion of all sections along a direction, (n,)."""
        return np.concatenate([part.uniform(direction) for part in self.parts])


def beam_body(case: Case, meshed: MeshedBeam, settings: BeamModel) -> Body:
    """Return the body of a case as a beam, whose mesh gives the contact faces and the fields. Collective."""
    started = time.perf_counter()
    beam = BeamOfParts.of_case(case, settings.elements, settings.graded)
    body, sparse = _on_parts(case, meshed, beam, settings.stations, "torsion" not in beam.motions)
    whole = settings.is_whole(len(beam.motions))
    shift, spans, holding = (2.0 * pi * overhang_frequency(case)) ** 2, None, None
    acting = acting_rows(case, body.patterns)
    bending = beam.parts[0]
    if not whole and isinstance(bending, BendingPart):
        highest = MODES_ABOVE * highest_frequency(case)
        lengths, waves = np.diff(bending.beam.places), wave_count(case)
        count = max(waves // WAVES_IN_SPAN, ceil(len(lengths) / LONGEST_SPAN))
        cuts = beam.at_nodes(cut_nodes(lengths, count))
        spans = span_basis(sparse, cuts, _touched(body.contact), acting, highest, waves * len(beam.parts))
        body, sparse = spanned(body, sparse, spans.columns)
    holds = held_rows(body)
    if len(holds):
        free = free_motions(holds, sparse, shift)
        holding = holding_shapes(body, body.contact, sparse.factor(shift, 1.0).solve, free)
        body, sparse = spanned(body, sparse, free)
    report = None if spans is None else spans.report(sparse.dense, len(acting))
    seconds = {"mesh": meshed.seconds, "assembly": time.perf_counter() - started}
    return replace(body, operators=sparse.dense, holding=holding, basis=report, seconds=seconds)


def rigid_body(case: Case, meshed: MeshedBeam) -> Body:
    """Return the body of a case as a rigid one.

    Its DOFs are the motions with V^T M V = 1 and V^T K V = diag(s), K the restraint. Where the motion is symmetric,
    those stay that loads or contact can cause: heave and pitch. Collective.
    """
    started = time.perf_counter()
    beam, symmetric = BeamOfParts.rigid(case, meshed), is_symmetric(case)
    body, sparse = _on_parts(case, meshed, beam, case.model.rings, symmetric)
    operators = sparse.dense
    body = replace(body, operators=operators)
    mass, restraint = operators.mass, operators.apply_restraint(np.identity(beam.size))
    squares, turn = eigh(0.5 * (restraint + restraint.T), mass)
    floating = Basis(np.asfortranarray(turn), np.maximum(squares, 0.0))
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    basis = held(body, floating, shift)
    if symmetric:
        turned, kept = moved(body, met_along_lines(case, body).contact, basis, shift)
        basis = turned.kept(kept)
    holding = holding_shapes(body, body.contact, floating.respond(operators, shift), basis.columns)
    assert isinstance(body.expansion, csr_matrix)
    expansion = np.asarray(body.expansion @ basis.columns)
    seconds = {"mesh": meshed.seconds, "assembly": time.perf_counter() - started}
    return replace(projected(body, body.contact, basis), holding=holding, expansion=expansion, seconds=seconds)


def _on_parts(
    case: Case, meshed: MeshedBeam, beam: BeamOfParts, stations: int | None, symmetric: bool
) -> tuple[Body, SparseOperators]:
    """Return the body of a case on the DOFs of a beam, and its M and K.

    Args:
        case: The case.
        meshed: Contact faces and nodes.
        beam: The beam.
        stations: Sections along each support that contact points lie around; None: where the mesh has them.
        symmetric: Whether nothing moves it out of the bending plane.

    Collective.
    """
    dimension = case.mesh.dimension
    contact = contact_operator(meshed.space, meshed.faces, case.layout.faces, meshed.width, point_rule(case))
    sparse = _restrained(case, beam, contact)
    contact, patch = gathered(case, _on_beam(contact, beam))
    if stations is None:
        contact = gathered_points(case, contact, symmetric, 1, meshed.facet_length)
        if case.contact.points is None:
            bending, parts = beam.parts[0], support_parts(case)
            nodes = bending.beam.places if isinstance(bending, BendingPart) else parts
            contact = along_elements(contact, case.layout.face_spans, np.union1d(parts, nodes))
    else:
        contact = _at_stations(contact, beam, case.layout.face_spans, stations)
    if case.follows_faces:
        contact = replace(contact, tangents=_tangents(contact, beam), frictionless=case.friction is None)
    patterns = []
    for load, part in patterned(case.load):
        along = load_direction(load, dimension)
        match part.place:
            case PointForce(point):
                patterns.append(beam.along(axis_point(point)[None], along[None]).toarray()[0])
            case LineForce(places, weights):
                rows = beam.along(np.array([axis_point(x) for x in places]), np.tile(along, (len(places), 1)))
                patterns.append(np.asarray(rows.T @ np.array(weights)))
            case BodyForce() | SupportAcceleration():
                patterns.append(sparse.apply_mass(beam.uniform(along)))
            case SupportWalls():
                patterns.append(np.zeros(sparse.size))
            case unknown:
                assert_never(unknown)
    patterns += [beam.mean_motion(one.motion) for one in attached_motions(case)]
    places = meshed.space.tabulate_dof_coordinates()[: meshed.space.dofmap.index_map.size_local]
    body = Body(
        case,
        meshed,
        sparse,
        contact,
        tuple(patterns),
        {probe.name: DenseRow(beam.displacement(axis_point(probe.point)[None]).toarray()) for probe in case.probe}
        | {
            f"{probe.name}{TURNED}": DenseRow(beam.turn(float(axis_point(probe.point)[0]), case.mesh.dimension))
            for probe in case.probe
            if probe.rotation
        },
        np.stack([sparse.apply_mass(motion) for motion in beam.rigid_motions()]),
        patch=patch,
        expansion=beam.displacement(places),
    )
    return body, sparse


def _touched(contact: ContactOperator) -> csr_matrix:
    """Return the motions of the contact points across the faces and, with friction, along them, (k, n)."""
    rows = csr_matrix(contact.gap_matrix)
    return rows if contact.rubbed is None else csr_matrix(vstack([rows, contact.rubbed]))


def _restrained(case: Case, beam: BeamOfParts, contact: ContactOperator) -> SparseOperators:
    """Return M and K, with the restraint of those motions along the faces that the beam has."""
    operators = beam.operators()
    sideways = not case.layout.holes and bool({"lateral", "torsion"} & set(beam.motions))
    springs = {
        0: axial_restraint(case).value if "axial" in beam.motions else 0.0,
        1: lateral_restraint(case).value if sideways else 0.0,
    }
    held = []
    for axis, spring in springs.items():
        if spring > 0.0:
            along = np.tile(np.identity(beam.dimension)[axis], (contact.size, 1))
            rows = beam.along(contact.positions, along)
            spread = spring / contact.area * contact.weights
            held.append(csr_matrix(rows.T @ rows.multiply(spread[:, None])))
    return SparseOperators(operators.mass, operators.stiffness, sum(held[1:], held[0])) if held else operators


def _on_beam(contact: ContactOperator, beam: BeamOfParts) -> ContactOperator:
    """Return the operator at the same points of the faces, on the DOFs of the beam."""
    opening = contact.support.opening(contact.faces, contact.positions[:, : beam.dimension])
    everywhere = np.arange(beam.size)
    gap = beam.along(contact.positions, opening)
    return replace(contact, interface=Interface(beam.size, everywhere, everywhere), gap_matrix=gap)


def _at_stations(
    contact: ContactOperator, beam: BeamOfParts, spans: Sequence[tuple[float, float]], count: int
) -> ContactOperator:
    """Return the operator at points around so many sections along each support.

    Args:
        contact: The operator at the points of the mesh, all of them around the beam, on the DOFs of the beam.
        beam: The beam, whose sections keep their shape.
        spans: First and last x of each face, m.
        count: Sections along each support.
    """
    found = [stations_along(*span, count) for span in spans]
    areas = [contact.weights[points].sum() for points in contact.points_of_faces]
    around = points_around(
        contact,
        np.concatenate([places for places, _ in found]),
        np.concatenate([area * shares for area, (_, shares) in zip(areas, found, strict=True)]),
        np.repeat(np.arange(len(spans)), count),
    )
    opening = contact.support.opening(around.faces, around.positions[:, : beam.dimension])
    shares = around.shares
    if isinstance(contact, ResultantOperator):  # of lines, each of which is gathered from points of the mesh
        shares = csr_matrix(shares @ contact.shares)
    return StationOperator(
        interface=contact.interface,
        gap_matrix=beam.along(around.positions, opening),
        weights=around.weights,
        initial_gap=around.gaps,
        faces=around.faces,
        support=contact.support,
        positions=around.positions,
        frictionless=contact.frictionless,
        shares=shares,
    )


def _tangents(contact: ContactOperator, beam: BeamOfParts) -> csr_matrix:
    """Return T at the contact points: the motion of the surface along the faces, point by point, (m k, n)."""
    opening = contact.support.opening(contact.faces, contact.positions[:, : beam.dimension])
    around = np.array([face.around for face in contact.support.faces])[contact.faces]
    directions = np.stack(along_faces(opening, around), axis=1)
    places = np.repeat(contact.positions, directions.shape[1], axis=0)
    return beam.along(places, directions.reshape(-1, beam.dimension))
