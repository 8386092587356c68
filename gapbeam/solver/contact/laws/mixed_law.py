"""Mixtures of contact laws: each acts on the contact points of its supports.

All forms of a law are taken point by point, so that a mixture is the laws side by side: what holds for each of them
(one solution of a step, a potential whose difference is the work of a discrete gradient) holds for all together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.point_law import LawTable
from gapbeam.solver.system.operators import Array, Indices


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

    def _table(self, size: int) -> LawTable:
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
