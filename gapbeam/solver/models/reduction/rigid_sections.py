"""Rigid sections for contact: at a few stations along each support, the section of the beam keeps its shape.

The contact points around a station all move by the two motions s of its section (`assembly.contact_assembly`),

    g_i = g0_i + c_i . s,

with the unit vectors c_i that open the gaps. Along their faces they move with the section as it turns. A basis needs 8
shapes for a support, and not one for every shape of pressure around it. What is left out is the deformation of the
sections in their plane: that a tube gives way under a force on one side, while a force on the rigid section is spread
all around. It is measured, on the mesh, for a pressure over half of the circumference of each support,
p = max(cos t, 0) about a direction.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.contact_assembly import RingRows, ring_rows
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.body import Body, point_rule
from gapbeam.solver.models.reduction.contact_lines import flexibilities, points_around, random_pressures
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.models.reduction.vibration_modes import Modes
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import ContactOperator


@dataclass(frozen=True)
class Neglected:
    """Static flexibility of the contact faces that a basis neglects.

    Attributes:
        local: Its share for pressures that vary from point to point.
        smooth: Its share for smooth pressures.
        section: By how much a section deforms under a force of 1 N, where sections are rigid, m/N; else None.
    """

    local: float
    smooth: float
    section: float | None = None


class KeptContact(Protocol):
    """Motion of the surface in the supports, in a basis."""

    @property
    def count(self) -> int:
        """Number of shapes that contact forces give the basis."""

    @property
    def points(self) -> ContactOperator:
        """The contact points that are marched, on the DOFs of the mesh."""

    @property
    def inputs(self) -> tuple[Any, ...]:
        """Inputs that the vectors and their neglected share follow from, besides the contact rows of the mesh."""

    def vectors(self, operators: PetscOperators, modes: Modes, shift: float) -> tuple[Array, float]:
        """Return modes and shapes, (n, k), and the largest `Modes.left`. Collective.

        Args:
            operators: M and K.
            modes: Modes with free faces, and the factor of K + sigma M.
            shift: sigma, 1/s^2.
        """

    def neglected(self, operators: PetscOperators, modes: Modes, basis: Basis, shift: float) -> Neglected:
        """Return the neglected flexibility of a basis; arguments as above. Collective."""


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
        supported, rule = body.contact.support.faces, point_rule(case)
        return cls(body, ring_rows(meshed.space, meshed.faces, supported, rule, stations, case.follows_faces))

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
        """The forces on the sections, and the pressures that measure what rigid sections leave out."""
        return (csr_matrix(self.rings.fits), _lobes(self.body.contact))

    def vectors(self, operators: PetscOperators, modes: Modes, shift: float) -> tuple[Array, float]:  # noqa: ARG002
        """Return modes and the responses to forces on the sections, (n, k), and `Modes.left`. Collective."""
        responses = modes.factor.solve_columns(self.rings.interface, csr_matrix(self.rings.fits.T))
        return np.concatenate([modes.shapes, responses], axis=1), modes.left

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
        surface: Theirs.
        opening: Unit vectors that open the gaps along y and z, (m, 2).
        across: The points along y and z, (m, 2), m.
        stations: That of each point, (m,).
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
