"""Floquet multipliers: how a small disturbance of a periodic response grows over one period.

They are the eigenvalues of the monodromy matrix, the derivative of the state after a period by the state at its start.
The response is stable if all lie inside the unit circle. As a parameter moves, a real one leaves through +1 (fold: two
responses meet and vanish), a real one through -1 (period doubling) or a pair elsewhere (Neimark-Sacker: a second
frequency appears). The multipliers of a motion that nothing damps lie on the circle, where round-off decides at which
side a computed one is: whether such a response is stable is not known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.system.operators import Array

Multipliers = NDArray[np.complex128]
REAL = 1.0e-6  # a multiplier with a smaller imaginary part, relative to it, is real

NEAR_ONE = 1.0e-8  # a multiplier as near to the unit circle may lie at either side of it

STABLE = "stable"
UNKNOWN = "not known"
FOLD = "fold"
PERIOD_DOUBLING = "period doubling"
NEIMARK_SACKER = "Neimark-Sacker"
PITCHFORK = "pitchfork"
BRANCH_POINT = "branch point"
GRAZING = "grazing"


@dataclass(frozen=True)
class Stability:
    """What the multipliers say.

    Attributes:
        multipliers: All, or the leading ones, by falling absolute value.
    """

    multipliers: Multipliers

    @property
    def largest(self) -> float:
        """Largest absolute value."""
        return float(np.abs(self.multipliers[0])) if len(self.multipliers) else 0.0

    @property
    def stable(self) -> bool | None:
        """Whether all multipliers lie inside the unit circle; None where the largest is too near to it to say."""
        return None if abs(self.largest - 1.0) <= NEAR_ONE else self.largest < 1.0

    @property
    def kind(self) -> str:
        """`STABLE`, `UNKNOWN`, or where the largest multiplier has left: fold, period doubling, Neimark-Sacker."""
        if self.stable is None:
            return UNKNOWN
        if self.stable:
            return STABLE
        leading = self.multipliers[0]
        if not _is_real(leading):
            return NEIMARK_SACKER
        return FOLD if leading.real > 0.0 else PERIOD_DOUBLING

    @property
    def doubling_test(self) -> float:
        """The product of 1 + mu_i, which changes its sign where one multiplier passes -1."""
        return float(np.prod(1.0 + self.multipliers).real)

    @property
    def unit_test(self) -> float:
        """The product of 1 - mu_i, which changes its sign where one multiplier passes +1."""
        return float(np.prod(1.0 - self.multipliers).real)

    @property
    def unstable(self) -> int:
        """Number of multipliers outside of the unit circle."""
        return int(np.sum(np.abs(self.multipliers) > 1.0 + NEAR_ONE))

    def distance(self, place: complex) -> float:
        """Return the distance of the nearest multiplier from a place on the unit circle."""
        return float(np.min(np.abs(self.multipliers - place), initial=np.inf))

    @property
    def unstable_pairs(self) -> int:
        """Number of complex pairs outside of the unit circle."""
        return sum(abs(one) > 1.0 + NEAR_ONE and one.imag > 0.0 and not _is_real(one) for one in self.multipliers)


def stability_of(monodromy: Array) -> Stability:
    """Return the multipliers of a monodromy matrix, (2n, 2n)."""
    return ordered(np.asarray(np.linalg.eigvals(monodromy), dtype=complex))


def ordered(multipliers: NDArray[np.complex128] | Array) -> Stability:
    """Return multipliers by falling absolute value."""
    found = np.asarray(multipliers, dtype=complex)
    return Stability(found[np.argsort(-np.abs(found), kind="stable")])


def _is_real(multiplier: complex) -> bool:
    return abs(multiplier.imag) <= REAL * abs(multiplier)
