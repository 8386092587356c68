"""Base of all time schemes: a table of the case file, coefficients, one step, and traits.

A scheme derives from `TimeScheme`, alone or by a family, and says all about itself there; whoever marches, checks or
ledgers asks the scheme and knows none by its name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from gapbeam.solver.integrators.noise_bias import NoiseBias
from gapbeam.solver.schema.table import Table
from gapbeam.solver.system.operators import Array

if TYPE_CHECKING:
    from gapbeam.solver.contact.laws.contact_law import ContactLaw
    from gapbeam.solver.contact.solve.condensation import Condensed
    from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem, State


class StiffnessRange(NamedTuple):
    """Softest and stiffest contact that a scheme is trusted with, in E/h of the body under it."""

    softest: float
    stiffest: float


STIFF_CONTACT = StiffnessRange(5.0, 100.0)  # edges that carry the beam give way by about 1 % of its sag
SOFT_CONTACT = StiffnessRange(0.05, 1.0)  # of schemes that may create energy at impacts


class KernelNumbers(NamedTuple):
    """Numbers by which the compiled march knows a scheme.

    Attributes:
        form: Form of the law in its step, `gapbeam.solver.contact.laws.law_tables`: MEAN and IMPLICIT march by the
            kernel of the midpoint rule, ENDPOINT by that of generalized-alpha.
        alpha_m: Of generalized-alpha, like the next three; of no meaning to the midpoint rule.
        alpha_f: Share of the old forces.
        beta: Weight of the new acceleration in the displacement.
        gamma: Its weight in the velocity.
    """

    form: int
    alpha_m: float = 0.0
    alpha_f: float = 0.0
    beta: float = 0.0
    gamma: float = 0.0


class TimeScheme(Table, ABC):
    """A time scheme.

    Attributes:
        type: Name of the scheme.
        carries_acceleration: Whether its state holds an acceleration.
        contact_range: Contact stiffness that it is trusted with.
        needs_massless_contact: Whether that holds for contact nodes without mass only; on others it creates energy.
        explicit: Whether it takes a diagonal mass matrix, and steps up to a stable one only.
        needs_factor: Whether iterations cannot take the place of a factor of its effective operator.
        impulses: Whether contact acts as impulses instead of a law.
        needs_potential: Whether the contact has to have a potential.
        conserves_energy: Whether every step conserves the energy of a contact without damping.
        has_period_map: Whether the derivative of its march over a period is known.
        marches_sets: Whether it marches contact that yields: its work over a step is known.
        implicit: Whether a scheme with a period map takes the law at the end of the step, or its discrete gradient.
        noise_bias: How far figures of rattling under noise are off, with its parameters as by default; empty: not
            measured.
    """

    type: str
    carries_acceleration: ClassVar[bool]
    contact_range: ClassVar[StiffnessRange]
    needs_massless_contact: ClassVar[bool] = False
    explicit: ClassVar[bool] = False
    needs_factor: ClassVar[bool] = False
    impulses: ClassVar[bool] = False
    needs_potential: ClassVar[bool] = False
    conserves_energy: ClassVar[bool] = False
    has_period_map: ClassVar[bool] = False
    marches_sets: ClassVar[bool] = False
    implicit: ClassVar[bool] = False
    noise_bias: ClassVar[tuple[NoiseBias, ...]] = ()

    @abstractmethod
    def coefficients(self, system: SemiDiscreteSystem, dt: float) -> tuple[float, float, float]:
        """Return (c_m, c_k, c_d) of the effective operator c_m M + c_k K + c_d dashpots."""

    @abstractmethod
    def advance(
        self,
        system: SemiDiscreteSystem,
        condensed: Condensed,
        law: ContactLaw,
        old: State,
        dt: float,
        max_iterations: int = 60,
    ) -> Step:
        """Advance by one step.

        Args:
            system: The system.
            condensed: Its effective operator for this step size.
            law: The contact law.
            old: State at t0.
            dt: Step, s.
            max_iterations: Limit of the contact solve.

        Raises:
            NotConverged: The contact solve failed; nothing has changed.

        Collective.
        """

    @abstractmethod
    def amplification(self, angle: float) -> Array:
        """Return the matrix A of a step on an undamped oscillator, y1 = A y0.

        Args:
            angle: w dt, circular frequency times step, no unit.

        Returns:
            A, (2, 2) for y = (u, dt v), or (3, 3) for y = (u, dt v, dt^2 a) where the state holds an acceleration.
        """

    @property
    @abstractmethod
    def creates_energy(self) -> bool:
        """True where the scheme may create energy at impacts on stiff contact."""

    def creates_energy_on(self, massless: bool) -> bool:
        """Return whether the scheme is known to create energy on contact nodes with or without mass."""
        return self.creates_energy or (self.needs_massless_contact and not massless)

    def contact_range_on(self, massless: bool) -> StiffnessRange:
        """Return the stiffness that the scheme is trusted with on contact nodes with or without mass."""
        return SOFT_CONTACT if self.needs_massless_contact and not massless else self.contact_range

    def warnings(self) -> Iterator[str]:
        """Yield the consequences of the scheme's values, for the warnings of a case."""
        if self.creates_energy:
            yield f"{self.type} creates energy at impacts; discrete-gradient conserves it"

    @property
    def measured_bias(self) -> tuple[NoiseBias, ...]:
        """The table `noise_bias`, where it holds for the parameters of the scheme; else nothing."""
        return self.noise_bias if self.noise_bias and self == type(self)(type=self.type) else ()

    @property
    def kernel(self) -> KernelNumbers | None:
        """Numbers for the compiled march; None: the scheme is marched step by step."""
        return None

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Refuse a scheme that leaves out what nobody may guess."""
        missing = [name for name in ("carries_acceleration", "contact_range") if not hasattr(cls, name)]
        if missing:
            raise TypeError(f"the scheme {cls.__name__} does not say {' and '.join(missing)}")


def kernel_of(scheme: TimeScheme) -> KernelNumbers | None:
    """Return the numbers of a scheme for the compiled march; None where no kernel marches it.

    A class that takes another step than the class whose numbers it inherits has no kernel.
    """
    for one in type(scheme).__mro__:
        if "kernel" in vars(one):
            return scheme.kernel
        if "advance" in vars(one) or "coefficients" in vars(one):
            return None
    return None
