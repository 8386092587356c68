"""Tables of contact laws with their traits: stops that yield or stiffen, and laws damped by restitution.

An elastic-plastic stop is elastic up to a yield pressure, then plastic, with a set that stays: the gap has grown. A
mass m that arrives at v0 on such a stop (F_y, k of the whole contact, no hardening) leaves a set s and returns at v1:

    m v0^2 / 2 = F_y s + F_y^2 / (2 k),    v1 = F_y / sqrt(k m)

A stiffening stop is a linear spring whose stiffness changes at given depths, with a constant damper:

    p(d) = K (<d> + sum_j (f_j - f_(j-1)) <d - d_j>) + c d',   f_0 = 1

K holds from touch to the first depth, f_j K from the depth d_j on: a force over penetration as a polygon. A buffer
before a hard stop and a bump stop are such laws.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from gapbeam.solver.contact.formulations.formulation_choice import ChosenFormulation
from gapbeam.solver.contact.laws.damper import Damper, per_area
from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.table import NonNegative, Number, Positive, Table
from gapbeam.solver.system.operators import Array


class ComputedDamping(NamedTuple):
    """Damping of a law: c, the reason, and the effect of half and double of it."""

    value: float
    reason: str
    consequence: str


class ChosenLaw(Table):
    """Table of a contact law in a case file.

    Attributes:
        type: Name of the law.
        jumps: c(d) is not 0 at touch: `ContactLaw.endpoint` switches such a damper on over a depth.
        exact: Exact formulations go by this law, without its damper.
        takes_damping: The coefficient is contact.damping; the others bring their own.
        by_touch_speed: The coefficient follows from the speed at touch of each point, as touch_product / speed.
        keeps_set: The law yields, and each point keeps its plastic set.
        rolls: Its resultant on the line along which a round section meets a flat wall is known, `line_law`.
    """

    type: str

    jumps: ClassVar[bool] = False
    exact: ClassVar[bool] = False
    takes_damping: ClassVar[bool] = False
    by_touch_speed: ClassVar[bool] = False
    keeps_set: ClassVar[bool] = False
    rolls: ClassVar[bool] = False

    @classmethod
    def __pydantic_init_subclass__(cls, **_: object) -> None:
        """Refuse names that nothing asks for, as a `pressure`: the law would be marched without it.

        Raises:
            TypeError: The class has such names; names of its own begin with an underscore.
        """
        known = {*dir(ChosenLaw), *cls.model_fields}
        unknown = sorted(name for name in vars(cls) if not name.startswith("_") and name not in known)
        if unknown:
            raise TypeError(
                f"the contact law {cls.__name__} defines {', '.join(unknown)}, which nothing asks for; expected traits "
                "of `ChosenLaw`: `own_spring` for an elastic pressure, `damper` for a damper, and names that "
                "begin with _ for what only the law itself uses"
            )

    @property
    def spring_exponent(self) -> float:
        """The exponent n of the spring K d^n, or of the growth at small penetrations."""
        return 1.0

    @property
    def own_spring(self) -> tuple[float, ...] | None:
        """Parameters of the spring K f(d), f by the formula of the law in `law_choice`; None: K d^n."""
        return None

    @property
    def bends(self) -> tuple[tuple[float, float], ...]:
        """Depths, m, from which the stiffness is a multiple of K, and these factors; for most laws none."""
        return ()

    @property
    def yield_point(self) -> tuple[float, float] | None:
        """Yield pressure, Pa, or force, N, and slope beyond it over K; None: the law does not yield."""
        return None

    @property
    def yields_as_whole(self) -> bool:
        """True where the law yields at a force of the whole support."""
        return False

    @property
    def dissipates(self) -> bool:
        """True where the law dissipates energy, contact.damping aside."""
        raise NotImplementedError

    @property
    def touch_product(self) -> float | None:
        """The product of coefficient and speed at touch; None: the coefficient is given."""
        return None

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the damper, per area.

        Args:
            damping: contact.damping, given or computed.
            areas: Areas that resultants at points are spread over, (m,), m^2: coefficients of a force are divided by
                them. 1: they are per area already.
        """
        raise NotImplementedError

    def computed_damping(
        self, stiffness: float, mass: float, adhesive: bool, units: tuple[str, str]
    ) -> ComputedDamping | None:
        """Return the damping that the law asks for instead of contact.damping; None: it asks for none.

        Args:
            stiffness: K of the contact, Pa/m, or N/m of a point.
            mass: Mass of the supported part of the beam that it carries, kg/m^2, or kg of a point.
            adhesive: Whether the damper may pull.
            units: Units of the mass and of the stiffness, for the words.
        """
        del stiffness, mass, adhesive, units
        return None

    def contradictions(self, formulation: ChosenFormulation, damping: float) -> Iterator[Fault]:
        """Yield the contradictions to the formulation of the contact or contact.damping."""
        del formulation, damping
        yield from ()


class ElasticPlastic(ChosenLaw):
    """A linear spring K that yields at a pressure, returns along K and keeps its plastic set."""

    dissipates: ClassVar[bool] = True

    type: Literal["elastic-plastic"] = Field(description="name of the law")
    yield_pressure: Positive | None = Field(
        default=None,
        description="pressure at which the stop yields (of each of contact.points in N), Pa",
        examples=[2.0e6],
    )
    yield_force: Positive | None = Field(
        default=None,
        description="force at which a whole support yields, instead of yield_pressure, at supports with "
        "support_stiffness, N",
        examples=[500.0],
    )
    hardening: Number = Field(
        default=0.0, ge=0, le=0.99, description="stiffness of loading beyond the yield pressure, relative to K, no unit"
    )

    takes_damping: ClassVar[bool] = True
    jumps: ClassVar[bool] = True
    keeps_set: ClassVar[bool] = True

    @property
    def yield_point(self) -> tuple[float, float]:
        """Yield pressure or force, and hardening."""
        return self.yield_pressure or self.yield_force or inf, self.hardening

    @property
    def yields_as_whole(self) -> bool:
        """True where a yield force is given."""
        return self.yield_force is not None

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the constant damper."""
        return Damper("kelvin-voigt", per_area(damping, areas))

    def contradictions(self, formulation: ChosenFormulation, damping: float) -> Iterator[Fault]:
        """The law has one yield point."""
        del formulation, damping
        if self.yield_pressure is None and self.yield_force is None:
            yield Fault(
                ("contact", "law", "yield_pressure"),
                "no yield_pressure and no yield_force",
                "one of the two: where the stop yields",
                "yield_pressure = 2e6, Pa, or yield_force = 500, N, with the support_stiffness of the support",
            )
        elif self.yield_pressure is not None and self.yield_force is not None:
            yield Fault(
                ("contact", "law", "yield_force"),
                f"{self.yield_force:g} N together with yield_pressure = {self.yield_pressure:g}",
                "one of the two",
                "leave one of them out",
                (("contact", "law", "yield_pressure"),),
            )


class RestitutionLaw(ChosenLaw):
    """Table of a law K d^n (1 + chi d'), chi = p / v0 by the restitution and the speed v0 at touch of each point."""

    exponent: Number = Field(default=1.0, ge=1, le=5, description="n, no unit; 1.5 is Hertz's")
    restitution: Number = Field(gt=0, le=1, description="coefficient of restitution, no unit", examples=[0.8])

    by_touch_speed: ClassVar[bool] = True
    rolls: ClassVar[bool] = True

    @property
    def spring_exponent(self) -> float:
        """The exponent n."""
        return self.exponent

    @property
    def dissipates(self) -> bool:
        """True for a restitution below 1."""
        return self.restitution < 1.0

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the damper with chi = 0, until the speed at touch is known."""
        del damping, areas
        return Damper("hunt-crossley")


class PiecewiseLinear(ChosenLaw):
    """A linear spring K whose stiffness changes at given depths: stops that stiffen, buffers."""

    dissipates: ClassVar[bool] = False

    type: Literal["piecewise-linear"] = Field(description="name of the law")
    depths: tuple[Positive, ...] = Field(
        min_length=1,
        max_length=100,
        description="penetrations at which the stiffness changes, ascending, m",
        examples=[[1.0e-4, 2.0e-4]],
    )
    factors: tuple[NonNegative, ...] = Field(
        min_length=1,
        max_length=100,
        description="stiffness beyond each of these depths, relative to K, no unit",
        examples=[[3.0, 20.0]],
    )

    takes_damping: ClassVar[bool] = True
    jumps: ClassVar[bool] = True

    @property
    def bends(self) -> tuple[tuple[float, float], ...]:
        """Depths with their factors."""
        return tuple(zip(self.depths, self.factors, strict=True))

    def damper(self, damping: float | Array, areas: float | Array) -> Damper:
        """Return the constant damper."""
        return Damper("kelvin-voigt", per_area(damping, areas))

    def contradictions(self, formulation: ChosenFormulation, damping: float) -> Iterator[Fault]:
        """Every depth has a factor, and depths ascend."""
        del formulation, damping
        if len(self.factors) != len(self.depths):
            yield Fault(
                ("contact", "law", "factors"),
                f"{counted(len(self.factors), 'factor')} for {counted(len(self.depths), 'depth')}",
                "one factor for each depth",
                f"factors = {[2.0 * (number + 1) for number in range(len(self.depths))]}",
                (("contact", "law", "depths"),),
            )
        if list(self.depths) != sorted(set(self.depths)):
            yield Fault(
                ("contact", "law", "depths"),
                f"{list(self.depths)} m",
                "depths that ascend, each once",
                f"depths = {sorted(set(self.depths))}",
            )


MEAN, IMPLICIT, ENDPOINT = 0, 1, 2  # its discrete gradient, at the end of the step, at one instant
