"""Contact laws with an elastic pressure e(d) of their own instead of K d^n, and mixtures of laws.

    p = e(d) + c(d) d' for d > 0,   psi(d) = int_0^d e

All forms of the law follow from these three functions: the discrete gradient is the difference quotient of the
potential, or a quadrature of e where two depths are so close that the difference would cancel. Machine code knows
springs K d^n only; such a law is marched step by step.

Of supports with different contact laws, each law acts on the contact points of its supports. All forms of a law are
taken point by point, so that a mixture is the laws side by side: what holds for each of them (one solution of a step, a
potential whose difference is the work of a discrete gradient) holds for all together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw, StagePressure
from gapbeam.solver.contact.laws.law_choice import FORMULAS, LAWS
from gapbeam.solver.contact.laws.own_spring import SHARES, WEIGHTS, OwnSpring
from gapbeam.solver.contact.laws.point_law import LawTable, fill_damping_parts
from gapbeam.solver.contact.laws.springs import FAR_APART, rows_of
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array, Indices

PROPORTIONAL = "hunt-crossley"  # its damper is chi K d^n


@dataclass(frozen=True)
class OwnSpringLaw(ContactLaw):
    """A law with a spring of its own; `spring` is K d, by which scales are judged.

    Attributes:
        name: Name of the law.
        own: Its spring.
    """

    name: str = ""
    own: OwnSpring = field(default=OwnSpring(np.zeros_like, np.zeros_like, np.zeros_like))

    @property
    def linear(self) -> bool:
        """No: it has a formula."""
        return False

    @property
    def why_not_compiled(self) -> str | None:
        """Kernels take springs K d^n."""
        return f"the contact law {self.name} has a spring of its own"

    def softened(self, share: float) -> OwnSpringLaw:
        """Return the law with a share of its stiffness."""
        spring = replace(self.spring, stiffness=share * self.spring.stiffness)
        return replace(self, spring=spring, own=self.own.scaled(share))

    def potential(self, depth: Array) -> Array:
        """Return psi(d), J/m^2."""
        return _where_closed(self.own.potential, depth)

    def damping(self, depth: Array) -> Array:
        """Return c(d), Pa s/m."""
        return np.asarray(self._damping_parts(depth)[0])

    def static(self, depth: Array) -> StagePressure:
        """Return p = e(d): the law at rest."""
        pressure = _where_closed(self.own.pressure, depth)
        return StagePressure(pressure, _where_closed(self.own.slope, depth), pressure)

    def discrete_gradient(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the mean pressure over a step whose elastic part does exactly the work psi(d1) - psi(d0)."""
        apart = new - old
        close = np.abs(apart) <= FAR_APART * np.maximum(np.abs(old), np.abs(new))
        between = old + SHARES.reshape(-1, *(1,) * old.ndim) * apart
        quotient = np.where(close, 1.0, apart)
        mean = np.where(
            close,
            np.tensordot(WEIGHTS, _where_closed(self.own.pressure, between), 1),
            (self.potential(new) - self.potential(old)) / quotient,
        )
        slope = np.where(
            close,
            np.tensordot(SHARES * WEIGHTS, _where_closed(self.own.slope, between), 1),
            (_where_closed(self.own.pressure, new) - mean) / quotient,
        )
        return self._damped(StagePressure(mean, np.maximum(slope, 0.0), mean), old, new, dt)

    def implicit(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure with the elastic part at the end of the step."""
        return self._damped(self.static(new), old, new, dt)

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Return the law at one instant, p = chi(d) <e(d) + c(d) d'>; see `ContactLaw.endpoint`."""
        elastic, (value, value_slope, _) = self.static(depth), self._damping_parts(depth)
        bracket = elastic.pressure + value * rate
        slope = np.maximum(elastic.slope + value * rate_slope + value_slope * rate, 0.0)
        if not self.adhesive:
            pressed = bracket > 0.0
            bracket, slope = np.where(pressed, bracket, 0.0), np.where(pressed, slope, 0.0)
        if not LAWS[self.damper.law].jumps or not np.any(self.damper.coefficient):
            return StagePressure(bracket, slope, elastic.pressure)
        share = np.clip(depth / self.touch_depth, 0.0, 1.0)
        rising = np.where((share > 0.0) & (share < 1.0), 1.0 / self.touch_depth, 0.0)
        return StagePressure(share * bracket, share * slope + rising * bracket, elastic.pressure)

    def table(self, size: int) -> LawTable:
        """Refuse: kernels take springs K d^n.

        Raises:
            ValueError: Always.
        """
        raise ValueError(f"{self.why_not_compiled}, and no table at {size} points; expected a spring K d^n")

    def _damped(self, elastic: StagePressure, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure of a step with (C(d1) - C(d0)) / dt added, clipped unless the damper may pull."""
        if not np.any(self.damper.coefficient):
            return elastic
        value, _, integral = self._damping_parts(new)
        pressure = elastic.pressure + (integral - self._damping_parts(old)[2]) / dt
        slope = elastic.slope + value / dt
        if not self.adhesive:
            pressed = pressure > 0.0
            pressure, slope = np.where(pressed, pressure, 0.0), np.where(pressed, slope, 0.0)
        return StagePressure(pressure, slope, elastic.elastic)

    def _damping_parts(self, depth: Array) -> Array:
        """Return c(d), its slope and its integral, (3, ..., m)."""
        rows = rows_of(depth)
        found = np.empty((3, *rows.shape))
        fill_damping_parts(super().table(rows.shape[1]), rows, found)
        return found.reshape(3, *depth.shape)


def own_spring_law(name: str, law: ContactLaw, own: OwnSpring) -> OwnSpringLaw:
    """Return a law with a spring of its own.

    Args:
        name: Name of the law.
        law: Its damper and its other traits.
        own: Its spring, per area.

    Raises:
        UserError: The functions of the spring do not belong together, or the damper is in proportion to K d^n.
    """
    own.check(name, law.touch_depth)
    if law.damper.law == PROPORTIONAL and np.any(law.damper.coefficient):
        known = " or ".join(one for one in FORMULAS if one != PROPORTIONAL)
        raise UserError(
            f"the law {name}: found the damper {PROPORTIONAL}, chi K d^n, beside a spring of its own; expected the "
            f"damper {known}, or one of its own"
        )
    return OwnSpringLaw(
        law.spring, law.damper, law.adhesive, law.touch_depth, law.touch_product, law.augmented,
        slowest_touch=law.slowest_touch, name=name, own=own,
    )  # fmt: skip


def _where_closed(function: Callable[[Array], Array], depth: Array) -> Array:
    """Return a function of depths d > 0, and 0 elsewhere."""
    closed = depth > 0.0
    return np.where(closed, function(np.where(closed, depth, 0.0)), 0.0)


class LawGroup(NamedTuple):
    """A law and the contact points where it acts, (k,)."""

    points: Indices
    law: ContactLaw


@dataclass(frozen=True)
class MixedLaw(ContactLaw):
    """Several laws, each at points of its own.

    Attributes:
        groups: The laws with their points; every contact point is in one group.
    """

    groups: tuple[LawGroup, ...] = ()

    @property
    def stiffness(self) -> float:
        """The largest K of the springs."""
        return max(law.stiffness for _, law in self.groups)

    @property
    def linear(self) -> bool:
        """True where all laws are linear."""
        return all(law.linear for _, law in self.groups)

    @property
    def bends(self) -> bool:
        """True where one of the laws bends."""
        return any(law.bends for _, law in self.groups)

    @property
    def why_not_compiled(self) -> str | None:
        """The reason of the first law that kernels do not take."""
        return next((law.why_not_compiled for _, law in self.groups if law.why_not_compiled is not None), None)

    def softened(self, share: float) -> MixedLaw:
        """Return the laws with a share of their stiffness."""
        return self._with(lambda group: group.law.softened(share))

    def touched_at(self, speed: Array | None) -> ContactLaw:
        """Return the laws for contacts that began at these speeds, (m,), m/s."""
        if self.touch_product is None or speed is None:
            return self
        return self._with(lambda group: group.law.touched_at(speed[group.points]))

    @property
    def keeps_set(self) -> bool:
        """True where one of the laws keeps a plastic set."""
        return any(law.keeps_set for _, law in self.groups)

    def yielded_by(self, plastic_set: Array | None) -> ContactLaw:
        """Return the laws of points that have plastic sets, (m,), m."""
        if plastic_set is None or not self.keeps_set:
            return self
        return self._with(lambda group: group.law.yielded_by(plastic_set[group.points]))

    def set_after(self, depth: Array) -> Array:
        """Return the plastic sets that are left of penetrations, (m,), m."""
        return self._gathered(depth, lambda points, law: law.set_after(depth[..., points]))

    def closed_slope(self, depth: Array) -> Array:
        """Return the slopes of the laws in small vibrations, (m,), Pa/m."""
        return self._gathered(depth, lambda points, law: law.closed_slope(depth[..., points]))

    def potential(self, depth: Array) -> Array:
        """Return psi(d), J/m^2."""
        return self._gathered(depth, lambda points, law: law.potential(depth[..., points]))

    def damping(self, depth: Array) -> Array:
        """Return c(d), Pa s/m."""
        return self._gathered(depth, lambda points, law: law.damping(depth[..., points]))

    def static(self, depth: Array) -> StagePressure:
        """Return p = e(d): the laws at rest."""
        return self._staged(depth, lambda points, law: law.static(depth[..., points]))

    def discrete_gradient(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the mean pressure over a step; see `ContactLaw.discrete_gradient`."""
        return self._staged(new, lambda at, law: law.discrete_gradient(old[..., at], new[..., at], dt))

    def implicit(self, old: Array, new: Array, dt: float) -> StagePressure:
        """Return the pressure with the elastic part at the end of the step."""
        return self._staged(new, lambda at, law: law.implicit(old[..., at], new[..., at], dt))

    def endpoint(self, depth: Array, rate: Array, rate_slope: float) -> StagePressure:
        """Return the laws at one instant; see `ContactLaw.endpoint`."""
        return self._staged(depth, lambda at, law: law.endpoint(depth[..., at], rate[..., at], rate_slope))

    def table(self, size: int) -> LawTable:
        """Return the tables of the laws as one for m = `size` points."""
        tables = [law.table(len(points)) for points, law in self.groups]
        owner, yielding = np.zeros(size, dtype=np.int64), np.zeros((size, 2))
        stiffness, coefficient = np.zeros((2, size))
        for number, ((points, _), one) in enumerate(zip(self.groups, tables, strict=True)):
            owner[points], yielding[points] = number, one.yielding
            stiffness[points], coefficient[points] = one.stiffness, one.coefficient
        rows = np.zeros((len(tables), max(one.rows.shape[1] for one in tables)))
        for number, one in enumerate(tables):
            rows[number, : one.rows.shape[1]] = one.rows
        return LawTable(rows, owner, self.touch_product is not None, stiffness, coefficient, yielding)

    def _with(self, changed: Callable[[LawGroup], ContactLaw]) -> MixedLaw:
        return replace(self, groups=tuple(LawGroup(group.points, changed(group)) for group in self.groups))

    def _gathered(self, like: Array, values: Callable[[Indices, ContactLaw], Array]) -> Array:
        found = np.zeros_like(like)
        for points, law in self.groups:
            found[..., points] = values(points, law)
        return found

    def _staged(self, like: Array, stage: Callable[[Indices, ContactLaw], StagePressure]) -> StagePressure:
        found = np.zeros((3, *like.shape))
        for points, law in self.groups:
            found[..., points] = np.stack(stage(points, law))
        return StagePressure(*found)


def mixed_law(groups: Sequence[LawGroup]) -> MixedLaw:
    """Return several laws, each at points of its own, as one.

    Args:
        groups: The laws with their points. Friction, impulses and multipliers are no part of single laws.
    """
    first = groups[0].law
    products = [law.touch_product for _, law in groups if law.touch_product is not None]
    return MixedLaw(
        spring=first.spring,
        adhesive=first.adhesive,
        touch_depth=first.touch_depth,
        touch_product=products[0] if products else None,
        slowest_touch=max(law.slowest_touch for _, law in groups),
        groups=tuple(groups),
    )
