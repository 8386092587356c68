"""What the table of a contact formulation says about the formulation: its traits, with the values that most have."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from gapbeam.solver.table import Table


class BodyShare(NamedTuple):
    """A penalty stiffness as a multiple of E/h, why, and what half and double of it would change."""

    share: float
    reason: str
    consequence: str


class StressTerms(NamedTuple):
    """What the stress of the body adds to contact: theta, and gamma relative to the eigenvalue of its trace problem."""

    theta: int
    factor: float


class ChosenFormulation(Table):
    """Table of a contact formulation in a case file.

    Attributes:
        type: Name of the formulation.
        follows_the_law: The pressure follows the law of the penetration; the other formulations are exact.
        takes_stiffness: contact.stiffness may be given.
        holds_points: Points are held like constraints: not more of them than DOFs that they constrain.
        takes_impulses: Impulses may replace the law.
        computed_stiffness: What the stiffness is, beside E/h; None: it follows from load, clearance and scheme.
    """

    type: str

    follows_the_law: ClassVar[bool] = False
    takes_stiffness: ClassVar[bool] = False
    holds_points: ClassVar[bool] = False
    takes_impulses: ClassVar[bool] = False
    computed_stiffness: ClassVar[BodyShare | None] = None

    @property
    def stress_terms(self) -> StressTerms | None:
        """Terms of the stress of the body, which only its mesh has; None: the pressure is not this stress."""
        return None

    @property
    def without_potential(self) -> str:
        """The formulation in words where contact has no potential; empty where it has one."""
        return ""

    @property
    def left_by_multipliers(self) -> float | None:
        """Penetration that multipliers shall leave, relative to that of the penalty alone; None: none are used."""
        return None
