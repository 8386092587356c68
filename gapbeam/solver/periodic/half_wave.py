"""Period maps of systems whose motion may be mirrored: odd under a change of sign and half a period.

Where loads change their sign after half a period, and what the structure may touch lies alike on both sides of its rest
position, -x(t + T/2) is a motion whenever x(t) is one. The period map is then the square of

    H(x) = -phi_(T/2)(x),    P = H o H

with the flow phi over half a period. Its fixed points are the symmetric periodic responses, x(t + T/2) = -x(t). Where a
multiplier of H passes -1, one of P passes +1: two responses that mirror each other branch off at a pitchfork. The curve
of symmetric responses is regular there for H, so that following H stays on it.

Source: Swift and Wiesenfeld, Phys. Rev. Lett. 52 (1984) 705, for half-wave symmetry and its bifurcations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.periodic.floquet import Stability, stability_of
from gapbeam.solver.periodic.shooting import PeriodMap, relative_change
from gapbeam.solver.system.operators import Array

ALIKE = 1.0e-6  # relative difference of two ends that round-off leaves
PROBED = 1.5, 0.3  # sizes of the states that the symmetry is tried on, and of the random part added to them


@dataclass(frozen=True)
class HalfWaveMap:
    """H, as a period map: its fixed points are the symmetric periodic responses.

    Attributes:
        whole: P.
        half: The flow over the first half of the period.
    """

    whole: PeriodMap
    half: PeriodMap

    @property
    def scale(self) -> Array:
        """That of P, (2n,)."""
        return self.whole.scale

    def after(self, x: Array) -> Array:
        """Return H(x), (2n,)."""
        return -self.half.after(x)

    def with_tangent(self, x: Array) -> tuple[Array, Array]:
        """Return H(x), (2n,), and H'(x), (2n, 2n)."""
        end, tangent = self.half.with_tangent(x)
        return -end, -tangent

    def stability(self, tangent: Array) -> Stability:
        """Return the multipliers of P, the squares of those of H."""
        return stability_of(tangent @ tangent)

    def reach(self, x: Array) -> Array:
        """Return how deep each face gets over the whole period, (faces,), m."""
        return self.whole.reach(x)

    def part(self, count: int) -> PeriodMap | None:
        """Return the flow over the first of `count` equal parts of the whole period."""
        return self.whole.part(count)


def half_wave(period_map: PeriodMap, x: Array) -> HalfWaveMap | None:
    """Return H where the system has this symmetry: where P and H o H agree on states of the size of a response.

    Args:
        period_map: P.
        x: State on a periodic response, (2n,).
    """
    half = period_map.part(2)
    if half is None:
        return None
    found = HalfWaveMap(period_map, half)
    random = np.random.default_rng(0).standard_normal(len(x)) / period_map.scale
    size = np.linalg.norm(period_map.scale * x) / np.linalg.norm(period_map.scale * random)
    factor, share = PROBED
    for tried in (x, factor * x, x + share * size * random):
        if relative_change(period_map.scale, period_map.after(tried), found.after(found.after(tried))) > ALIKE:
            return None
    return found


def is_symmetric(half: HalfWaveMap, x: Array) -> bool:
    """Return whether a state lies on a symmetric response: H(x) = x."""
    return relative_change(half.scale, x, half.after(x)) <= ALIKE
