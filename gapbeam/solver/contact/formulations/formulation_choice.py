"""Contact formulations: their tables, the union of them, and the traits that the rest of the code asks for.

Penalty: the pressure follows a law of the penetration. Augmented Lagrangian: a penalty, and multipliers that are
updated until nothing penetrates. Nitsche: the stress of the body is part of the pressure (`assembly.contact_assembly`).
Unilateral: the gap stays at zero, by a penalty that is rigid compared with the body, or by impulses.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field

from gapbeam.solver.schema.table import OF_TYPE, Positive, Table


class BodyShare(NamedTuple):
    """A penalty stiffness as a multiple of E/h, the reason, and the effect of half and double of it."""

    share: float
    reason: str
    consequence: str


class StressTerms(NamedTuple):
    """Terms of Nitsche's method: theta, and gamma relative to the eigenvalue of the trace problem."""

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
        computed_stiffness: Stiffness over E/h; None: it follows from load, clearance and scheme.
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
        """Penetration that multipliers leave, relative to the penalty alone; None: none are used."""
        return None


class Penalty(ChosenFormulation):
    """The law acts on the penetration itself."""

    type: Literal["penalty"] = Field(default="penalty", description="name of the formulation")

    follows_the_law: ClassVar[bool] = True
    takes_stiffness: ClassVar[bool] = True


AUGMENTED = 10.0  # of E/h


class AugmentedLagrangian(ChosenFormulation):
    """Unilateral contact by multipliers that are updated until nothing penetrates."""

    without_potential: ClassVar[str] = "augmented-lagrangian"

    type: Literal["augmented-lagrangian"] = Field(description="name of the formulation")
    penetration: Positive = Field(
        default=1.0e-4, lt=1, description="largest penetration, relative to the penalty alone, no unit"
    )

    takes_stiffness: ClassVar[bool] = True
    holds_points: ClassVar[bool] = True
    computed_stiffness: ClassVar[BodyShare | None] = BodyShare(
        AUGMENTED,
        "multipliers settle in a few updates",
        "half: more updates of the multipliers in a step; double: fewer; the same answer",
    )

    @property
    def left_by_multipliers(self) -> float:
        """The penetration asked for."""
        return self.penetration


class NitscheMethod(ChosenFormulation):
    """Nitsche's method: consistent, the pressure is the stress of the body (Chouly, Hild and Renard 2015)."""

    type: Literal["nitsche"] = Field(description="name of the formulation")
    theta: Literal[1, 0, -1] = Field(default=1, description="1 symmetric, 0 incomplete, -1 skew, no unit")
    factor: Positive = Field(
        default=2.0, description="gamma relative to the largest eigenvalue of the trace problem of each cell, no unit"
    )

    @property
    def stress_terms(self) -> StressTerms:
        """The terms with theta and factor."""
        return StressTerms(self.theta, self.factor)

    @property
    def without_potential(self) -> str:
        """Only the symmetric form has a potential."""
        return f"nitsche, theta = {self.theta}" if self.theta != 1 else ""


RIGID = 1.0e8  # of E/h: compresses by 1e-8 of what the body does


class Unilateral(ChosenFormulation):
    """Exact unilateral contact: g >= 0, p >= 0, g p = 0."""

    type: Literal["unilateral"] = Field(description="name of the formulation")

    holds_points: ClassVar[bool] = True
    takes_impulses: ClassVar[bool] = True
    computed_stiffness: ClassVar[BodyShare | None] = BodyShare(
        RIGID, "rigid beside the body", "half or double: no change that one could measure"
    )


Formulation = Annotated[
    Penalty | NitscheMethod | Unilateral | AugmentedLagrangian,
    OF_TYPE,
]
