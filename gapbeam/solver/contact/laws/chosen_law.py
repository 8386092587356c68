"""Traits of a contact law, from its table, with the values that most laws have."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from gapbeam.solver.contact.formulations.formulation_choice import ChosenFormulation
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.errors import Fault
from gapbeam.solver.system.operators import Array
from gapbeam.solver.table import Table

if TYPE_CHECKING:
    from gapbeam.solver.contact.laws.own_spring import OwnSpring


class ComputedDamping(NamedTuple):
    """A damping that a law asks for: c, why, and what half and double of it would change."""

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
        keeps_set: It yields, and each point keeps its plastic set.
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
            TypeError: There are such names; names of its own begin with an underscore.
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

    def own_spring(self, stiffness: float | Array) -> OwnSpring | None:
        """Return the elastic pressure of the law, its slope and its potential; None: K d^n.

        Args:
            stiffness: K, per area, given or computed; one number or one at each point, (m,), Pa/m^n.
        """
        del stiffness
        return None

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
