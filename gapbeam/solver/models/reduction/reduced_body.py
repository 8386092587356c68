"""Reduced body, from an assembled one.

    u = V q,    V^T M V = 1,    V^T K V = diag(s)

V spans the vibration modes of the body, its deflections under unit loads and those under pressures on the contact
faces. With free contact faces the latter are A^-1 G^T p, A = K + sigma M: what the modes miss of the static response,
the residual flexibility (Rubin 1975); with fixed ones they are the static response to motions of the interface DOFs,
the constraint modes (Craig and Bampton 1968). Rigid motions are always in V: the body floats.

Contact surfaces deform: a basis keeps the response to shapes of pressure on them, or to all forces. Craig and Bampton's
vectors are modes with fixed interface DOFs, and constraint modes. A constraint mode is the static response of the
interior to a motion of the interface DOFs, K_ii x_i = -K_ib x_b. Where only some shapes of pressure are kept, the
motions are those of the interface DOFs that follow these shapes best.

Rigid sections for contact: at a few stations along each support, the section of the beam keeps its shape.

The contact points around a station all move by the two motions s of its section (`assembly.contact_assembly`),

    g_i = g0_i + c_i . s,

with the unit vectors c_i that open the gaps. Along their faces they move with the section as it turns. A basis needs 8
shapes for a support, and not one for every shape of pressure around it. What is left out is the deformation of the
sections in their plane: that a tube gives way under a force on one side, while a force on the rigid section is spread
all around. It is measured, on the mesh, for a pressure over half of the circumference of each support,
p = max(cos t, 0) about a direction.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_matrix, identity

from gapbeam.solver.assembly.assembled_system import acting_rows
from gapbeam.solver.assembly.contact_assembly import RingRows, ring_rows
from gapbeam.solver.case.beam_motions import is_symmetric
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.solution_tables import ReducedModel
from gapbeam.solver.contact.formulations.contact_points import ElementOperator, ResultantOperator
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.body import Body, point_rule
from gapbeam.solver.models.kept_files import kept_or_found
from gapbeam.solver.models.reduction.contact_lines import (
    REACH,
    along_elements,
    face_shapes,
    flexibilities,
    gathered_points,
    neglected_shares,
    points_around,
    random_pressures,
    support_parts,
    within_reach,
)
from gapbeam.solver.models.reduction.modal_basis import Basis, modal_basis
from gapbeam.solver.models.reduction.projection import Kept, held, holding_shapes, moved, projected
from gapbeam.solver.models.reduction.span_basis import BasisReport
from gapbeam.solver.models.reduction.vibration_modes import Modes, lowest_modes, with_rigid_motions
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import ContactOperator


@dataclass(frozen=True)
class Neglected:
    """Static flexibility of the contact faces that a basis neglects.

    Attributes:
        local: Its share for pressures that vary from point to point.
        smooth: Its share for smooth pressures.
        section: Deformation of a section under a force of 1 N, where sections are rigid, m/N; else None.
    """

    local: float
    smooth: float
    section: float | None = None


PRESSED = np.array([[0.0, -1.0], [1.0, 0.0]])  # directions along y and z of the pressures that measure what is left out


@dataclass(frozen=True)
class RigidSections:
    """Rigid sections at stations along the supports of a body.

    Attributes:
        body: The body, all of whose supports are around it.
        rings: The stations.
    """

    body: Body
    rings: RingRows

    @classmethod
    def of_body(cls, body: Body, stations: int) -> RigidSections:
        """Return the rigid sections of a body, so many along each support. Collective."""
        meshed, case = body.meshed, body.case
        supported, rule, spans = body.contact.support.faces, point_rule(case), case.layout.face_spans
        return cls(body, ring_rows(meshed.space, meshed.faces, supported, spans, rule, stations, case.follows_faces))

    @property
    def count(self) -> int:
        """Number of shapes that contact forces give the basis: those of the polynomials, along y and z."""
        return int(self.rings.fits.shape[0])

    @cached_property
    def points(self) -> ContactOperator:
        """The points around the stations."""
        return on_rigid_sections(self.body.contact, self.body.meshed.space, self.rings)

    @property
    def inputs(self) -> tuple[Any, ...]:
        """The forces on the sections, and the pressures that measure the error of rigid sections."""
        return (csr_matrix(self.rings.fits), _lobes(self.body.contact))

    def vectors(self, operators: PetscOperators, modes: Modes, shift: float) -> tuple[list[Array], float]:  # noqa: ARG002
        """Return modes and the responses to forces on the sections, each (n, k), and `Modes.left`. Collective."""
        responses = modes.factor.solve_columns(self.rings.interface, csr_matrix(self.rings.fits.T))
        return [modes.shapes, responses], modes.left

    def neglected(self, operators: PetscOperators, modes: Modes, basis: Basis, shift: float) -> Neglected:
        """Return the neglected flexibility, for random pressures and for half of the circumference. Collective."""
        contact, lobes = self.body.contact, _lobes(self.body.contact)
        local = random_pressures(contact, lobes.shape[1])
        missing, elastic = flexibilities(
            operators, contact, modes.factor, basis, shift, np.concatenate([local, lobes], axis=1)
        )
        halves = zip(np.split(missing, 2), np.split(elastic, 2), strict=True)
        everywhere, on_one_side = (max(float(missed.sum() / whole.sum()), 0.0) for missed, whole in halves)
        return Neglected(everywhere, on_one_side, max(float(missing[lobes.shape[1] :].max()), 0.0))


def on_rigid_sections(contact: ContactOperator, space: Any, rings: RingRows) -> ResultantOperator:
    """Return the operator at points around the stations.

    Args:
        contact: The operator at the points of the mesh, all of them around the beam.
        space: The space of the mesh.
        rings: The stations.

    Collective.
    """
    slots = rings.slots_of(space, contact.interface)
    entries = contact.gap_matrix.tocoo()
    whole = (contact.size, rings.interface.size)
    mesh = replace(
        contact,
        interface=rings.interface,
        gap_matrix=csr_matrix((entries.data, (entries.row, slots[entries.col])), whole),
        tangents=None,
    )
    around = points_around(contact, rings.places, rings.areas, rings.faces)
    places, faces, numbers = around.positions, around.faces, around.stations
    opening = contact.support.opening(faces, places)[:, 1:]
    rows, count = np.arange(len(places)), len(places)
    turned = csr_matrix(
        (opening.reshape(-1), (np.repeat(rows, 2), np.stack([2 * numbers, 2 * numbers + 1], axis=1).reshape(-1))),
        (count, rings.motions.shape[0]),
    )
    return ResultantOperator(
        interface=rings.interface,
        gap_matrix=csr_matrix(turned @ rings.motions),
        weights=around.weights,
        initial_gap=around.gaps,
        faces=faces,
        support=contact.support,
        positions=places,
        tangents=None if rings.surface is None else _tangents(rings, rings.surface, opening, places[:, 1:], numbers),
        frictionless=contact.frictionless,
        distributed=mesh,
        shares=around.shares,
    )


def _tangents(rings: RingRows, surface: csr_matrix, opening: Array, across: Array, stations: Indices) -> csr_matrix:
    """Return T: motion along the beam and around it, point by point, (2m, interface.size).

    Args:
        rings: The stations.
        surface: Surface rows of the stations.
        opening: Unit vectors that open the gaps along y and z, (m, 2).
        across: The points along y and z, (m, 2), m.
        stations: Station of each point, (m,).
    """
    count = len(stations)
    y, z = across.T
    around = np.stack([-opening[:, 1], opening[:, 0]], axis=1)
    ones, rows = np.ones(count), np.arange(count)

    def of(values: Array, row: Indices, first: Indices, columns: int) -> csr_matrix:
        """Return a matrix with some neighbors in each row."""
        places = first[:, None] + np.arange(values.shape[1])
        return csr_matrix(
            (values.reshape(-1), (np.repeat(row, values.shape[1]), places.reshape(-1))), (2 * count, columns)
        )

    along = of(np.stack([ones, y, z], axis=1), 2 * rows, 4 * stations, surface.shape[0])
    moved = of(around, 2 * rows + 1, 2 * stations, rings.values.shape[0])
    arms = around[:, 1] * y - around[:, 0] * z
    turned = of(arms[:, None], 2 * rows + 1, 4 * stations + 3, surface.shape[0])
    return csr_matrix((along + turned) @ surface + moved @ rings.motions)


def _lobes(contact: ContactOperator) -> Array:
    """Return pressures with a resultant of 1 N on half of the circumference, (m, k), 1/m^2: two for each support."""
    lobes = list[Array]()
    for face in range(len(contact.face_names)):
        for direction in PRESSED:
            lobe = np.where(contact.faces == face, np.maximum(contact.across @ -direction, 0.0), 0.0)
            force = float(np.linalg.norm((contact.weights * lobe) @ contact.across))
            if force > 0.0:  # else no wall is there
                lobes.append(lobe / force)
    return np.stack(lobes, axis=1)


HELD = 1.0e-10  # of the mass matrix of the faces, for interface DOFs that hardly any point sees


def fixed_interface_vectors(
    operators: PetscOperators,
    contact: ContactOperator,
    free: Modes,
    shapes: Array | None,
    settings: ReducedModel,
    shift: float,
) -> tuple[Array, float]:
    """Return rigid motions, fixed-interface modes and constraint modes, (n, k), and `Modes.left` of these modes.

    Args:
        operators: M and K.
        contact: The contact points.
        free: Modes with free faces, of which the motions of the rigid body are taken.
        shapes: Shapes on the faces, (m, shapes); None: every interface DOF.
        settings: Number of modes.
        shift: sigma, 1/s^2.

    Collective.
    """
    mass, stiffness = operators.matrices()
    interface = contact.interface
    first = stiffness.getOwnershipRange()[0]
    rows = (interface.owned + first).astype(PETSc.IntType)
    largest = float(stiffness.getDiagonal().max()[1])
    stiffness.zeroRowsColumns(rows, diag=largest)
    least = float(mass.getDiagonal().min()[1])
    # the frequency of the rows of fixed DOFs lies above all others
    mass.zeroRowsColumns(rows, diag=least)
    shifted = operators.shifted_solver(mass, stiffness.copy(), shift, operators.solver.basis_tolerance)
    modes = lowest_modes(mass, stiffness, shifted, shift, settings.modes, settings.frequency)
    motions = np.identity(interface.size) if shapes is None else _fitted(contact, shapes)
    # constraint modes nearly cancel where they make up a motion of the whole body
    interior = operators.solver_of(stiffness, "gapbeam_interior_", operators.solver.tolerance)
    constraints = np.empty((operators.size, motions.shape[1]), order="F")
    for number, motion in enumerate(motions.T):
        moved = np.zeros(operators.size)
        interface.add(moved, motion)
        pull = -operators.apply_stiffness(moved)
        pull[interface.owned] = 0.0
        constraints[:, number] = interior.solve(pull) + moved
    rigid = free.shapes[:, free.squares < shift]
    elastic = modes.shapes[:, : settings.modes] if settings.frequency is None else modes.shapes
    return np.concatenate([rigid, elastic, constraints], axis=1), modes.left


def _fitted(contact: ContactOperator, shapes: Array) -> Array:
    """Return the motions of the interface DOFs whose gaps are nearest to shapes, (interface.size, shapes)."""
    gap, weights = contact.gap_matrix, contact.weights[:, None]
    gram = (gap.T @ gap.multiply(weights)).toarray()
    gram[np.diag_indices_from(gram)] += HELD * gram.diagonal().max()
    return np.asarray(np.linalg.solve(gram, gap.T @ (weights * shapes)))


CHECKED = 8  # random pressures of the truncation check


@dataclass(frozen=True)
class DeformableSections:
    """The surfaces of a body in its supports, as its mesh has them.

    Attributes:
        body: The body.
        settings: Shapes to keep.
    """

    body: Body
    settings: ReducedModel

    @property
    def count(self) -> int:
        """Number of shapes that contact forces give the basis."""
        return self.body.contact.interface.size if self._pressures is None else self._pressures.shape[1]

    @cached_property
    def points(self) -> ContactOperator:
        """Contact points of the mesh, or fewer across the width, and along the faces as hats ask for."""
        case, settings, length = self.body.case, self.settings, self.body.meshed.facet_length
        lines = gathered_points(case, self.body.contact, is_symmetric(case), settings.points_across, length)
        if "all" in (settings.contact, settings.points_across) or case.contact.points is not None:
            return lines
        return along_elements(lines, case.layout.face_spans, support_parts(case, settings.shapes - 1))

    @property
    def inputs(self) -> tuple[Any, ...]:
        """The pressures whose shapes are kept, where they are, and which points can touch."""
        return (self._pressures, self.body.contact.positions, self._touching)

    def vectors(self, operators: PetscOperators, modes: Modes, shift: float) -> tuple[list[Array], float]:
        """Return modes and contact shapes, each (n, k), and the largest `Modes.left`. Collective."""
        contact, shapes = self.body.contact, self._pressures
        if self.settings.interface == "fixed":
            vectors, left = fixed_interface_vectors(operators, contact, modes, shapes, self.settings, shift)
            return [vectors], max(modes.left, left)
        interface = contact.interface
        if shapes is None:
            columns = csr_matrix(identity(interface.size))
        else:
            columns = csr_matrix(contact.resultants @ (contact.weights[:, None] * shapes))
        return [modes.shapes, modes.factor.solve_columns(interface, columns)], modes.left

    def neglected(self, operators: PetscOperators, modes: Modes, basis: Basis, shift: float) -> Neglected:
        """Return the neglected flexibility, for random pressures at the points, and of half the length of a shape."""
        contact, touching = self.body.contact, self._touching
        halves = face_shapes(contact, 2 * self.settings.shapes - 1, (0,), touching)
        smooth = random_pressures(contact, CHECKED, halves)
        local = np.where(touching[:, None], random_pressures(contact, CHECKED), 0.0)
        return Neglected(*neglected_shares(operators, contact, modes.factor, basis, shift, [local, smooth]))

    @cached_property
    def _touching(self) -> NDArray[np.bool_]:
        """Mask of the points of the mesh that can touch."""
        return within_reach(self.body.contact, REACH * self.body.case.profile.thinnest)

    @cached_property
    def _pressures(self) -> Array | None:
        """The pressures whose shapes are kept, (m, shapes); None: one for each interface DOF."""
        case, contact = self.body.case, self.body.contact
        if self.settings.contact == "all":
            return None
        if case.contact.points is not None:
            return np.asarray(np.identity(contact.size))
        powers = (0,) if case.mesh.dimension == 2 else (0, 2) if is_symmetric(case) else (0, 1, 2)
        return face_shapes(contact, self.settings.shapes, powers, self._touching)


RIGID_MODES = {2: 3, 3: 6}
ACROSS = 3  # Gauss points in y^2, which no motion moves that is not symmetric: single points of a mesh do


@dataclass(frozen=True)
class FoundBasis:
    """A basis of a floating body, with figures of the search.

    Attributes:
        floating: The basis on this rank.
        modes: Vibration modes in it, rigid ones included.
        highest_mode: The highest of their frequencies, Hz.
        left: The largest error of the modes that round-off left.
        neglected: Static flexibility that the basis neglects.
    """

    floating: Basis
    modes: int
    highest_mode: float
    left: float
    neglected: Neglected


def reduced_body(body: Body, settings: ReducedModel) -> Body:
    """Reduce a finite element body.

    Raises:
        RunError: The modes could not be found.

    Collective.
    """
    started = time.perf_counter()
    case, operators = body.case, body.operators
    assert isinstance(operators, PetscOperators)
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    rings = settings.rings
    contact = DeformableSections(body, settings) if rings is None else RigidSections.of_body(body, rings)
    acting = acting_rows(case, body.patterns)

    def find() -> FoundBasis:
        count = RIGID_MODES[case.mesh.dimension] + settings.modes
        factor = operators.shifted_factor(shift)
        modes = lowest_modes(*operators.products(), factor, shift, count, settings.frequency, operators.has_massless)
        modes = with_rigid_motions(modes, operators)
        loads = [modes.factor.solve(row)[:, None] for row in acting]
        vectors, left = contact.vectors(operators, modes, shift)
        floating = modal_basis(operators, np.concatenate([*vectors, *loads], axis=1), shift)
        highest = float(modes.frequencies.max(initial=0.0))
        return FoundBasis(
            floating, len(modes.squares), highest, left, contact.neglected(operators, modes, floating, shift)
        )

    points = body.contact
    solver = (operators.solver.iterative, operators.solver.basis_tolerance)
    given = (settings.model_dump_json(), case.mesh.dimension, shift, solver, operators.has_massless)
    rows = (points.gap_matrix, points.weights, points.faces, points.interface.owned, points.interface.slots)
    inputs = (*given, *rows, *acting, *contact.inputs, *_images(operators))
    comm = body.meshed.tagged.mesh.comm
    found = kept_or_found(comm, FoundBasis, inputs, find)
    floating = found.floating
    basis = held(body, floating, shift)
    kept: Kept = np.ones(len(basis.squares), dtype=bool)
    if is_symmetric(case):
        mirrored = gathered_points(case, points, True, ACROSS, body.meshed.facet_length)
        lines = contact.points.distributed if isinstance(contact.points, ElementOperator) else contact.points
        basis, kept = moved(body, mirrored if lines is points else lines, basis, shift)
    report = BasisReport(
        modes=found.modes,
        highest_mode=found.highest_mode,
        contact_shapes=contact.count,
        load_shapes=len(acting),
        size=int(np.sum(kept)),
        left_out=int(np.sum(~kept)),
        highest=float(np.sqrt(basis.squares[kept].max()) / (2.0 * pi)),
        neglected=found.neglected.local,
        neglected_smooth=found.neglected.smooth,
        modes_left=found.left,
        section_flexibility=found.neglected.section,
    )
    basis = basis.kept(kept)
    return replace(
        projected(body, contact.points, basis),
        meshed=body.meshed.as_arrays() if comm.size == 1 else body.meshed,
        basis=report,
        holding=holding_shapes(body, contact.points, floating.respond(operators, shift), basis.columns),
        seconds=body.seconds | {"reduction": time.perf_counter() - started},
    )


def _images(operators: PetscOperators) -> Iterator[Array]:
    """Yield M x and K x of two pseudo-random vectors: inputs that change when any entry does. Collective."""
    draw = np.random.default_rng(operators.size)
    for x in draw.standard_normal((2, operators.size)):
        yield operators.apply_mass(x)
        yield operators.apply_stiffness(x)
