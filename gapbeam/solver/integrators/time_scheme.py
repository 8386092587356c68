"""Base of all time schemes: a table of the case file, coefficients, one step, and traits.

A scheme derives from `TimeScheme`, alone or by a family, and says all about itself there; whoever marches, checks or
ledgers asks the scheme and knows none by its name.

Bias of the figures of a rattling mass under noise by scheme and steps per contact.

The exact law is that of a mass on a spring before one stop 100 times as stiff, with white noise. Differences within two
standard errors of chance are 0. Measured by `python3 -m benchmarks.scheme_bias`, docs/benchmarks/statistics.md.

The time step that a frequency of interest and contacts ask for.

    h = 1 / (50 f),    and at most T_c / 20 where 1 / (2 T_c) < 10 f

f is the highest frequency of interest, T_c the duration of a contact. A contact whose frequency is ten times f is rigid
on the time scale of interest, and not resolved. Without a frequency of interest all contacts are resolved.

Source: at n steps in a period the midpoint rule makes it (2 pi / n)^2 / 12 too long, 0.13 % at 50; 20 steps in a
contact are the least that peak forces ask for.

Numerical damping ratio and period error of a time scheme, on a linear oscillator.

A step of a scheme takes the undamped oscillator u'' + w^2 u = 0 from y0 to y1 = A(w dt) y0. The pair of
eigenvalues of A with the largest modulus, exp((-z +- i) W dt), is the motion that the scheme marches: of damping
ratio z and frequency W instead of 0 and w. Its period is too long by w / W - 1.

Source: Hughes (1987), The Finite Element Method, section 9.3; Hilber and Hughes (1978).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from math import inf, log2
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from gapbeam.solver.schema.table import Table
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem, State

if TYPE_CHECKING:
    from gapbeam.solver.contact.laws.contact_law import ContactLaw
    from gapbeam.solver.contact.solve.condensation import Condensed
    from gapbeam.solver.system.semi_discrete import Step

SECOND_ORDER = 0.25  # of a bias is left at half the step


class NoiseBias(NamedTuple):
    """Relative bias of the figures of a rattling mass.

    Attributes:
        steps: Steps in the duration of a contact.
        mean_square: Mean square of the displacement.
        contact_share: Share of the time in contact.
        mean_force: Mean contact force.
        mean_square_force: Mean square of the mean forces of steps.
        impact_rate: Impacts per second.
    """

    steps: float
    mean_square: float
    contact_share: float
    mean_force: float
    mean_square_force: float
    impact_rate: float


def bias_at(table: tuple[NoiseBias, ...], steps: float) -> NoiseBias | None:
    """Return the bias at some number of steps in a contact; None: nothing was measured.

    Straight lines over the logarithm of the steps. Below the first row it stays as in the first row, which is too
    small there; beyond the last one it falls by the order that the last two rows show, at least as slowly as measured.

    Args:
        table: Rows by rising numbers of steps, each twice the number before.
        steps: Steps in the duration of a contact, > 0.
    """
    if not table:
        return None
    first, last = table[0], table[-1]
    if steps <= first.steps:
        return first._replace(steps=steps)
    if steps >= last.steps:
        halvings = log2(steps / last.steps)
        pairs = zip(table[-2][1:], last[1:], strict=True)
        return NoiseBias(steps, *(now * _left(before, now) ** halvings for before, now in pairs))
    upper = next(number for number, row in enumerate(table) if row.steps > steps)
    low, high = table[upper - 1], table[upper]
    share = log2(steps / low.steps) / log2(high.steps / low.steps)
    return NoiseBias(steps, *(a + share * (b - a) for a, b in zip(low[1:], high[1:], strict=True)))


def _left(before: float, now: float) -> float:
    """Return the part of a bias that half the step leaves, from two rows."""
    return min(max(now / before, SECOND_ORDER), 1.0) if before != 0.0 else SECOND_ORDER


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
        alpha_m: Parameter alpha_m of generalized-alpha, like the next three; of no meaning to the midpoint rule.
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
        noise_bias: Bias of figures of rattling under noise, with its parameters as by default; empty: not
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

    @property
    def excess(self) -> tuple[str, str, str] | None:
        """Parameters with which impacts make energy on any contact: found, expected and advice; None: no such ones."""
        return None

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
        """Refuse a scheme without required declarations."""
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


STEPS_PER_PERIOD = 50  # of the highest frequency of interest
STEPS_PER_CONTACT = 20  # for peak forces
RIGID_RATIO = 10.0  # of contact frequency to frequency of interest; a stiffer contact is rigid on that time scale


def step_of_period(frequency: float) -> float:
    """Return 1 / (50 f), s; infinite for 0 Hz."""
    return 1.0 / (STEPS_PER_PERIOD * frequency) if frequency > 0.0 else inf


def is_rigid(duration: float, frequency: float) -> bool:
    """Return whether a contact of a duration, s, is rigid on the time scale of a frequency, Hz."""
    return 0.0 < RIGID_RATIO * frequency <= 0.5 / duration


LARGEST_ERROR = 1.0  # of a period; a motion without a period, or beyond stability, counts as this much off


class SchemeError(NamedTuple):
    """Numerical damping and period error of a scheme at given frequencies.

    Attributes:
        damping_ratio: z, no unit; negative where the motion grows, infinite where one step ends it.
        period_error: w / W - 1, no unit; infinite where there is no oscillation.
    """

    damping_ratio: Array
    period_error: Array


def scheme_error(scheme: TimeScheme, angles: Array) -> SchemeError:
    """Return damping ratio and period error of a scheme.

    Args:
        scheme: The time scheme.
        angles: w dt of each motion, (k,), > 0.
    """
    damping, error = np.empty(len(angles)), np.empty(len(angles))
    for place, angle in enumerate(angles):
        values = np.linalg.eigvals(scheme.amplification(float(angle)))
        swinging = values[np.imag(values) > 0.0]
        if not len(swinging):
            largest = float(np.max(np.abs(values)))
            damping[place], error[place] = np.inf if largest < 1.0 else -np.inf, np.inf
            continue
        pair = swinging[np.argmax(np.abs(swinging))]
        turned = float(np.angle(pair))
        damping[place] = -float(np.log(np.abs(pair))) / turned
        error[place] = float(angle) / turned - 1.0
    return SchemeError(damping, error)


def carried_error(scheme: TimeScheme, angles: Array, power: Array) -> tuple[float, float]:
    """Return the mean damping ratio and the mean size of the period error over a spectrum of kinetic energy.

        sum_j P_j z(w_j dt) / sum_j P_j,    sum_j P_j |w_j / W_j - 1| / sum_j P_j

    Args:
        scheme: The time scheme.
        angles: w dt of each line of the spectrum, (k,).
        power: P, its energy in any unit, (k,), >= 0.

    Returns:
        Both, each line counted up to 1; 0 where nothing moves.
    """
    total = float(np.sum(power))
    if total <= 0.0:
        return 0.0, 0.0
    found = scheme_error(scheme, angles)
    ratios, errors = (
        np.clip(x, -LARGEST_ERROR, LARGEST_ERROR) for x in (found.damping_ratio, np.abs(found.period_error))
    )
    return float(power @ ratios) / total, float(power @ errors) / total
