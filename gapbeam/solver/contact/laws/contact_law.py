"""Contact law, per area: an elastic and a damped pressure, adhesive or not.

With the penetration d = -g, the closed law is

    p = e(d) + c(d) d'   for d > 0,   p = 0 otherwise,

clipped at p >= 0 unless the face may pull (`adhesive`). Each time scheme asks for the law in the form that it can
trust; clipped, all forms are non-decreasing in the penetration at the end of the step, so that the step has one
solution. The formulas stand in `point_law`, for one point; they serve both marches.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.damper import NO_DAMPER, CoulombFriction, Damper, padded, per_area
from gapbeam.solver.contact.laws.law_choice import FORMULAS, HUNT_CROSSLEY, LAWS, SPRINGS, UNDAMPED
from gapbeam.solver.contact.laws.law_tables import IMPLICIT, MEAN, ChosenLaw
from gapbeam.solver.contact.laws.own_spring import check_spring
from gapbeam.solver.contact.laws.point_law import (
    LawNumbers,
    LawTable,
    StepNumbers,
    fill_damping,
    fill_elastic,
    fill_endpoint,
    fill_stage,
    fill_touch_factors,
    row_of,
)
from gapbeam.solver.contact.laws.springs import Spring, at_points, rows_of
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array


class StagePressure(NamedTuple):
    """A law evaluated at m points: pressure (Pa), its slope in the penetration (Pa/m), and its elastic part (Pa)."""

    pressure: Array
    slope: Array
    elastic: Array


@dataclass(frozen=True)
class ContactLaw:
    """Spring, damper and clipping.

    Attributes:
        spring: e(d).
        damper: c(d).
        adhesive: True: the damper pulls while the face separates; False: p is clipped at zero.
        touch_depth: Depth over which `endpoint` switches a damper that jumps at touch on, m.
        touch_product: p = chi v0 of a damper whose coefficient chi follows from the speed v0 at touch of each point;
            None: the coefficient is given.
        stores_energy: False where the scheme puts impulses instead of the spring.
        friction: Traction along the face; None: none.
        augmented: Penetration that multipliers leave, relative to the penalty alone; None: none are used.
        slowest_touch: Speed as which slower touches are damped where there is a touch_product, m/s.
        ramps: Stiffness over K and depth, m, of linear springs that begin at a depth; the sum does not fall.
        yield_pressure: p_y of a linear spring without a set, Pa, one number or one of each point, (m,); None: it does
            not yield. Midpoint rules march laws that do.
        hardening: h, slope of loading beyond it over K, 0 <= h < 1.
        plastic_set: s, (m,), m; 0: no point has yielded.

    Raises:
        ValueError: The damper or the spring is that of no law, or slow touches have no bound.
    """

    spring: Spring
    damper: Damper = NO_DAMPER
    adhesive: bool = False
    touch_depth: float = 1.0e-8
    touch_product: float | None = None
    augmented: float | None = None
    stores_energy: bool = True
    friction: CoulombFriction | None = None
    slowest_touch: float = 0.0
    ramps: tuple[tuple[float, float], ...] = ()
    yield_pressure: float | Array | None = None
    hardening: float = 0.0
    plastic_set: float | Array = 0.0

    def __post_init__(self) -> None:
        """Refuse a law without a formula."""
        if self.damper.law not in FORMULAS:
            raise ValueError(f"no damping formula of a law {self.damper.law!r}; there are {', '.join(FORMULAS)}")
        if self.spring.law not in SPRINGS:
            raise ValueError(f"no spring formula of a law {self.spring.law!r} in `law_choice.SPRINGS`")
        if self.touch_product is not None and not self.slowest_touch > 0.0:
            raise ValueError(
                f"slowest_touch = {self.slowest_touch}: damping by the speed at touch needs a positive one"
            )

    @property
    def stiffness(self) -> float:
        """K of the spring; the largest where points differ."""
        return float(np.max(self.spring.stiffness))

    @property
    def linear(self) -> bool:
        """True where closed contact is a linear spring, with a constant damper or none."""
        return self.spring.exponent == 1.0 and self.damper.law == NO_DAMPER.law and not (self.bends or self.spring.law)

    @property
    def bends(self) -> bool:
        """True where the stiffness of closed contact changes at depths."""
        return bool(self.ramps) or self.keeps_set

    @property
    def keeps_set(self) -> bool:
        """True where points yield and keep a plastic set."""
        return self.yield_pressure is not None

    def yielded_by(self, plastic_set: Array | None) -> ContactLaw:
        """Return the law of points that have plastic sets, (m,), m; itself where nothing yields."""
        return replace(self, plastic_set=plastic_set) if self.keeps_set and plastic_set is not None else self

    def set_after(self, depth: Array) -> Array:
        """Return the plastic sets that are left of penetrations, (m,), m."""
        if self.yield_pressure is None:
            return np.zeros_like(depth)
        most = (1.0 - self.hardening) * (depth - self.yield_pressure / self.spring.stiffness)
        return np.maximum(most, self.plastic_set)

    def closed_slope(self, depth: Array) -> Array:
        """Return the slope of the law in small vibrations about penetrations, which do not yield, (m,), Pa/m."""
        if self.keeps_set:
            return np.where(depth > self.plastic_set, self.spring.stiffness, 0.0)
        return self.static(depth).slope

    def softened(self, share: float) -> ContactLaw:
        """Return the law with a share of its stiffness, damping and yield pressure."""
        limit = None if self.yield_pressure is None else share * self.yield_pressure
        return replace(self, spring=replace(self.spring, stiffness=share * self.spring.stiffness), yield_pressure=limit)

    def touched_at(self, speed: Array | None) -> ContactLaw:
        """Return the law for contacts that began at these speeds, (m,), m/s; itself where that makes no difference."""
        if self.touch_product is None or speed is None:
            return self
        factor = np.empty(len(speed))
        fill_touch_factors(float(self.touch_product), float(self.slowest_touch), np.ascontiguousarray(speed), factor)
        return replace(self, damper=replace(self.damper, coefficient=factor))

    def potential(self, depth: Array) -> Array:
        """Return psi(d), J/m^2."""
        return self._elastic(depth)[2] if self.stores_energy else np.zeros_like(depth)

    def damping(self, depth: Array) -> Array:
        """Return c(d), Pa s/m."""
        rows = rows_of(depth)
        found = np.empty_like(rows)
        fill_damping(self.table(rows.shape[1]), rows, found)
        return found.reshape(depth.shape)

    def static(self, depth: Array) -> StagePressure:
        """Return p = e(d): the law at rest."""
        pressure, slope, _ = self._elastic(depth)
        return StagePressure(pressure, slope, pressure)

    def _elastic(self, depth: Array) -> Array:
        """Return e(d), its slope and psi(d), (3, ..., m)."""
        rows = rows_of(depth)
        found = np.empty((3, *rows.shape))
        fill_elastic(self.table(rows.shape[1]), rows, found)
        return found.reshape(3, *depth.shape)

    def discrete_gradient(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the mean pressure over a step whose elastic part does exactly the work psi(d1) - psi(d0).

        p = (psi(d1) - psi(d0)) / (d1 - d0) + (C(d1) - C(d0)) / dt,  C' = c.

        Args:
            old: d0 at the start of the step, (..., m), m.
            new: d1 at its end, (..., m), m.
            dt: Step, s.

        Source: Simo and Tarnow (1992); Gonzalez (1996) for the discrete gradient of a scalar potential.
        """
        return self._over_step(MEAN, old, new, dt)

    def implicit(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure with the elastic part at the end of the step, p = e(d1) + (C(d1) - C(d0)) / dt."""
        return self._over_step(IMPLICIT, old, new, dt)

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Return the law at one instant, p = chi(d) <e(d) + c(d) d'>, of `point_law.endpoint_pressure`.

        Args:
            depth: d, (m,), m.
            rate: d', (m,), m/s.
            rate_slope: Derivative of d' with respect to d in the scheme, 1/s.

        Raises:
            ValueError: The law yields: only the work of midpoint steps is known.
        """
        if self.keeps_set:
            raise ValueError("a contact law that yields at one instant; expected a midpoint rule, which knows its work")
        rows = rows_of(depth)
        found = np.empty((3, *rows.shape))
        fill_endpoint(self.table(rows.shape[1]), rows, rows_of(rate), float(rate_slope), found)
        return StagePressure(*found.reshape(3, *depth.shape))

    def table(self, size: int) -> LawTable:
        """Return the law as numbers and arrays for m = `size` points, without friction and multipliers."""
        if size not in self._tables:
            self._tables[size] = self._table(size)
        return self._tables[size]

    @cached_property
    def _tables(self) -> dict[int, LawTable]:
        """Tables that were asked for, by the number of points: each step asks for the same one."""
        return {}

    def _table(self, size: int) -> LawTable:
        yielding = np.zeros((size, 2))
        if self.yield_pressure is not None:
            yielding[:, 0], yielding[:, 1] = self.plastic_set, self.yield_pressure / self.spring.stiffness
        return LawTable(
            row_of(self.numbers)[None],
            np.zeros(size, dtype=np.int64),
            self.touch_product is not None,
            at_points(self.spring.stiffness, size),
            at_points(self.damper.coefficient, size),
            yielding,
        )

    @cached_property
    def numbers(self) -> LawNumbers:
        """Numbers of the law that are the same at all points; a damper without a coefficient is left out."""
        damped = self.touch_product is not None or bool(np.any(self.damper.coefficient))
        return LawNumbers(
            float(self.spring.exponent),
            FORMULAS[self.damper.law] if damped else UNDAMPED,
            padded(self.damper.law, self.damper.parameters),
            LAWS[self.damper.law].jumps and not self.damper.parameters,
            bool(self.adhesive),
            float(self.touch_depth),
            float(self.touch_product or 0.0),
            float(self.slowest_touch),
            1.0 - self.hardening if self.keeps_set else 0.0,
            SPRINGS[self.spring.law],
            padded(self.spring.law, self.spring.parameters),
            np.array(self.ramps).reshape(-1),
        )

    def _over_step(self, form: int, old: Array, new: Array, dt: float) -> StagePressure:
        rows = rows_of(new)
        found = np.empty((3, *rows.shape))
        fill_stage(StepNumbers(form, float(dt), 0.0, 0.0), self.table(rows.shape[1]), rows_of(old), rows, found)
        return StagePressure(*found.reshape(3, *new.shape))


def kelvin_voigt(
    stiffness: float, damping: float = 0.0, adhesive: bool = False, touch_depth: float = 1.0e-8
) -> ContactLaw:
    """Return p = eps d + c d', with eps in Pa/m and c in Pa s/m."""
    return ContactLaw(Spring(stiffness), Damper("kelvin-voigt", damping), adhesive, touch_depth)


def make_law(
    chosen: ChosenLaw,
    stiffness: float | Array,
    touch_depth: float,
    damping: float | Array = 0.0,
    areas: float | Array = 1.0,
    adhesive: bool = False,
    augmented: float | None = None,
    slowest_touch: float = 0.0,
    nominal: float | Array = 1.0,
) -> ContactLaw:
    """Return the contact law, per area, of a table of a case file.

    Args:
        chosen: The table.
        stiffness: K of the case or its computed value; or at each point, (m,), that of its support or Nitsche's gamma.
        touch_depth: Depth over which `ContactLaw.endpoint` switches a damper that jumps on, m.
        damping: contact.damping, given or computed, or that at each point, (m,).
        areas: Areas that resultants at points are spread over, (m,), m^2: K in N/m^n and c in N s/m are divided by
            them. 1: K and c are per area already.
        adhesive: Whether the damper may pull.
        augmented: As in `ContactLaw`.
        slowest_touch: As in `ContactLaw`, m/s.
        nominal: Nominal areas of whole supports, which a yield force is divided by, (m,) or one number, m^2.

    Raises:
        UserError: A law with a spring of its own has functions that do not belong together, or a damper in proportion
            to K d^n.
    """
    own, (limit, hardening) = chosen.own_spring, chosen.yield_point or (None, 0.0)
    factors = [1.0, *(factor for _, factor in chosen.bends)]
    law = ContactLaw(
        Spring(per_area(stiffness, areas), chosen.spring_exponent, "" if own is None else chosen.type, own or ()),
        chosen.damper(damping, areas),
        adhesive,
        touch_depth,
        chosen.touch_product,
        augmented,
        slowest_touch=slowest_touch,
        ramps=tuple((float(rise), depth) for rise, (depth, _) in zip(np.diff(factors), chosen.bends, strict=True)),
        yield_pressure=None if limit is None else per_area(limit, nominal if chosen.yields_as_whole else areas),
        hardening=hardening,
    )
    if own is not None:
        _check_own(law)
    return law


def _check_own(law: ContactLaw) -> None:
    name, shape = law.spring.law, ContactLaw(replace(law.spring, stiffness=1.0))
    if FORMULAS[law.damper.law] == HUNT_CROSSLEY and np.any(law.damper.coefficient):
        known = " or ".join(one for one, formula in FORMULAS.items() if formula != HUNT_CROSSLEY)
        raise UserError(
            f"the law {name}: found the damper {law.damper.law}, chi K d^n, beside a spring of its own; expected the "
            f"damper {known}, or one of its own"
        )
    check_spring(
        name, law.touch_depth, lambda d: shape.static(d).pressure, lambda d: shape.static(d).slope, shape.potential
    )


def step_slopes(law: ContactLaw, implicit: bool, old: Array, new: Array, dt: float) -> tuple[Array, Array]:
    """Return the derivatives of the pressure of a step by the penetrations at its start and end, (m,) each, Pa/m.

    The discrete gradient of a step reversed in time is the same pressure, so its slope in the start equals the slope of
    the reversed step in its end. At touch the law has a kink; the slope on one side of it is returned.

    Args:
        law: The contact law.
        implicit: Whether the pressure is the law at the end of the step, or its discrete gradient.
        old: Penetrations at the start, (m,), m.
        new: Penetrations at the end, (m,), m.
        dt: Step, s.
    """
    if not implicit:
        return law.discrete_gradient(new, old, -dt).slope, law.discrete_gradient(old, new, dt).slope
    stage = law.implicit(old, new, dt)
    pressed = (stage.pressure > 0.0) | law.adhesive
    return np.where(pressed, -law.damping(old) / dt, 0.0), stage.slope
