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
from gapbeam.solver.case.beam_motions import is_symmetric
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.solution_tables import ReducedModel
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.kept_files import kept_or_found
from gapbeam.solver.models.reduction.basis_report import BasisReport
from gapbeam.solver.models.reduction.contact_lines import face_shapes, neglected_shares, random_pressures, within_reach
from gapbeam.solver.models.reduction.line_points import REACH, gathered_points
from gapbeam.solver.models.reduction.modal_basis import Basis, modal_basis
from gapbeam.solver.models.reduction.projection import Kept, held, holding_shapes, moved, projected
from gapbeam.solver.models.reduction.rigid_sections import KeptContact, Neglected, RigidSections
from gapbeam.solver.models.reduction.vibration_modes import Modes, lowest_modes, with_rigid_motions
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

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
        """Contact points of the mesh, or fewer across the width."""
        case, across = self.body.case, self.settings.points_across
        return gathered_points(case, self.body.contact, is_symmetric(case), across, self.body.meshed.facet_length)

    @property
    def inputs(self) -> tuple[Any, ...]:
        """The pressures whose shapes are kept, where they are, and which points can touch."""
        return (self._pressures, self.body.contact.positions, self._touching)

    def vectors(self, operators: PetscOperators, modes: Modes, shift: float) -> tuple[Array, float]:
        """Return modes and contact shapes, (n, k), and the largest `Modes.left`. Collective."""
        contact, shapes = self.body.contact, self._pressures
        if self.settings.interface == "fixed":
            vectors, left = fixed_interface_vectors(operators, contact, modes, shapes, self.settings, shift)
            return vectors, max(modes.left, left)
        interface = contact.interface
        if shapes is None:
            columns = csr_matrix(identity(interface.size))
        else:
            columns = csr_matrix(contact.resultants @ (contact.weights[:, None] * shapes))
        return np.concatenate([modes.shapes, modes.factor.solve_columns(interface, columns)], axis=1), modes.left

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
    """A basis of a body that floats, and what was learned as it was found.

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
    contact = _kept_contact(body, settings)
    acting = acting_rows(case, body.patterns)

    def find() -> FoundBasis:
        count = RIGID_MODES[case.mesh.dimension] + settings.modes
        factor = operators.shifted_factor(shift)
        modes = lowest_modes(*operators.products(), factor, shift, count, settings.frequency, operators.has_massless)
        modes = with_rigid_motions(modes, operators)
        loads = np.stack([modes.factor.solve(row) for row in acting], axis=1) if acting else None
        vectors, left = contact.vectors(operators, modes, shift)
        floating = modal_basis(operators, np.concatenate([vectors, *([] if loads is None else [loads])], axis=1), shift)
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
        kept = moved(body, mirrored if contact.points is points else contact.points, basis)
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


def _kept_contact(body: Body, settings: ReducedModel) -> KeptContact:
    """Return the contact of a body that the basis keeps. Collective."""
    if settings.rings is None:
        return DeformableSections(body, settings)
    return RigidSections.of_body(body, settings.rings)
