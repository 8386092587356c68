"""Whether multipliers are known: found in several ways, and these agree.

Multipliers that come from an approximate motion can be off by any factor while the motion itself converges: a contact
of a few instants decides about them, and a truncated series places it by chance. They are known where every way of
finding the largest one says the same, to a share of it, and none of them is as near to the unit circle as they are
apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gapbeam.solver.periodic.floquet import NEAR_ONE, Stability

MOST_APART = 0.1  # between two ways, relative to the larger of 1 and the largest multiplier


@dataclass(frozen=True)
class Judgment:
    """What several ways of finding the multipliers of one response say together.

    Attributes:
        stability: The multipliers that are reported, where they are known.
        error: How far the largest one may be off: the largest difference between two ways.
        doubts: Why the multipliers are not known, one clause each; none where they are.
    """

    stability: Stability
    error: float
    doubts: tuple[str, ...] = ()

    @property
    def known(self) -> bool:
        """Whether nothing speaks against them."""
        return not self.doubts


def judged(stability: Stability, others: Mapping[str, Stability], way: str = "these harmonics") -> Judgment:
    """Return multipliers that were found in one way, judged by those of other ways.

    Args:
        stability: Those of the best way.
        others: Those of other ways, by name.
        way: Name of the best way.
    """
    found = {way: stability, **others}
    largest = {name: one.largest for name, one in found.items()}
    apart = max(largest.values()) - min(largest.values())
    words = ", ".join(f"{value:.4g} by {name}" for name, value in largest.items())
    if not apart <= MOST_APART * max(1.0, stability.largest):
        return Judgment(stability, apart, (f"the largest multiplier is {words}",))
    doubts = doubts_near_one(stability.largest, apart)
    if len({one.kind for one in found.values()}) > 1 and not doubts:
        kinds = ", ".join(f"{one.kind} by {name}" for name, one in found.items())
        doubts = (f"the response is {kinds}",)
    return Judgment(stability, apart, doubts)


def with_error(stability: Stability, error: float) -> Judgment:
    """Return multipliers whose largest one may be off by an error, judged by that."""
    if not error <= MOST_APART * max(1.0, stability.largest):
        return Judgment(
            stability, error, (f"the largest multiplier, {stability.largest:.4g}, may be off by {error:.2g}",)
        )
    return Judgment(stability, error, doubts_near_one(stability.largest, error))


def doubts_near_one(largest: float, error: float) -> tuple[str, ...]:
    """Return the doubt about a multiplier that may lie at either side of the unit circle; none where it cannot."""
    if abs(largest - 1.0) <= NEAR_ONE:
        return ("the largest multiplier is 1 but for round-off, as that of a motion that nothing damps",)
    if abs(largest - 1.0) > error:
        return ()
    return (f"the largest multiplier, {largest:.4g}, may be off by {error:.2g}: at either side of 1",)
