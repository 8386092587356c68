"""Contact on surfaces that deform: a basis keeps the response to shapes of pressure on them, or to all forces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, identity

from gapbeam.solver.case.model_table import ReducedModel
from gapbeam.solver.case.symmetry import is_symmetric
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.reduction.contact_lines import within_reach
from gapbeam.solver.models.reduction.face_shapes import face_shapes
from gapbeam.solver.models.reduction.fixed_interface import fixed_interface_vectors
from gapbeam.solver.models.reduction.kept_contact import Neglected
from gapbeam.solver.models.reduction.line_points import REACH, gathered_points
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.models.reduction.truncation_check import neglected_shares, random_pressures
from gapbeam.solver.models.reduction.vibration_modes import Modes
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

CHECKED = 8  # random pressures of the truncation check


@dataclass(frozen=True)
class DeformableSections:
    """The surfaces of a body in its supports, as its mesh has them.

    Attributes:
        body: The body.
        settings: What is kept of them.
    """

    body: Body
    settings: ReducedModel

    @property
    def count(self) -> int:
        """Number of shapes that contact forces give the basis."""
        return self.body.contact.interface.size if self._pressures is None else self._pressures.shape[1]

    @cached_property
    def points(self) -> ContactOperator:
        """Those of the mesh, or fewer across the width."""
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
        """Return what a basis neglects, for random pressures at the points, and of half the length of a shape."""
        contact, touching = self.body.contact, self._touching
        halves = face_shapes(contact, 2 * self.settings.shapes - 1, (0,), touching)
        smooth = random_pressures(contact, CHECKED, halves)
        local = np.where(touching[:, None], random_pressures(contact, CHECKED), 0.0)
        return Neglected(*neglected_shares(operators, contact, modes.factor, basis, shift, [local, smooth]))

    @cached_property
    def _touching(self) -> NDArray[np.bool_]:
        """Which points of the mesh can touch."""
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
