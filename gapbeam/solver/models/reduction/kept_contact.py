"""What a basis keeps of the contact of a body: shapes that contact forces give it, and the points that are marched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.models.reduction.vibration_modes import Modes
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator


@dataclass(frozen=True)
class Neglected:
    """What a basis neglects of the static flexibility of the contact faces.

    Attributes:
        local: Its share for pressures that vary from point to point.
        smooth: Its share for smooth pressures.
        section: By how much a section deforms under a force of 1 N, where sections are rigid, m/N; else None.
    """

    local: float
    smooth: float
    section: float | None = None


class KeptContact(Protocol):
    """How the surface in the supports moves in a basis."""

    @property
    def count(self) -> int:
        """Number of shapes that contact forces give the basis."""

    @property
    def points(self) -> ContactOperator:
        """The contact points that are marched, on the DOFs of the mesh."""

    @property
    def inputs(self) -> tuple[Any, ...]:
        """What its vectors and what they neglect follow from beside the contact rows of the mesh."""

    def vectors(self, operators: PetscOperators, modes: Modes, shift: float) -> tuple[Array, float]:
        """Return modes and shapes, (n, k), and the largest `Modes.left`. Collective.

        Args:
            operators: M and K.
            modes: Modes with free faces, and the factor of K + sigma M.
            shift: sigma, 1/s^2.
        """

    def neglected(self, operators: PetscOperators, modes: Modes, basis: Basis, shift: float) -> Neglected:
        """Return what a basis neglects; arguments as above. Collective."""
