"""Which fidelity level to take for a tolerance, and whether the tolerance is promised.

A tolerance is promised where the level is inside it over the span of the case: error and uncertainty of the reference
together, in every window. What is missing is a doubt, and a doubt is never dropped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite

from gapbeam.studies.tradeoff.level_errors import Judged

WHOLE = 1.0 - 1.0e-6  # share of the end of a case that counts as all of it


@dataclass(frozen=True)
class Grounds:
    """What is known of all levels of a trade-off.

    Attributes:
        end: Simulated time of the case, s.
        uncertainty: Of the reference, by group of figures.
        chaotic: Whether the response never repeats.
        cut: Why the reference was not marched over the whole case; "" where it was.
    """

    end: float
    uncertainty: Mapping[str, float]
    chaotic: bool = False
    cut: str = ""

    def span_words(self, covered: float) -> str:
        """Return the part of the case that errors cover, in words."""
        if covered >= WHOLE * self.end:
            return f"over the {self.end:.4g} s of the case"
        words = f"over the first {covered:.3g} s of {self.end:.4g} s"
        return f"{words}, and in means beyond" if self.chaotic else words


def choice(levels: Sequence[Judged], tolerance: float, grounds: Grounds) -> Judged | None:
    """Return the cheapest level inside a tolerance, those that promise it first; None where none is inside."""
    inside = [one for one in levels if one.inside(tolerance)]
    return min(inside, key=lambda one: (bool(doubts(one, tolerance, grounds)), one.seconds), default=None)


def nearest(levels: Sequence[Judged], grounds: Grounds) -> Judged | None:
    """Return the level nearest to the reference, those with errors over the whole case first; None: all failed."""
    passed = [one for one in levels if one.measured.verdict == "passed" and one.errors]
    return min(passed, key=lambda one: (one.covered < WHOLE * grounds.end, _off(one), one.seconds), default=None)


def doubts(one: Judged, tolerance: float, grounds: Grounds) -> list[str]:
    """Return why a tolerance is not promised for a level; nothing where it is.

    Args:
        one: The level.
        tolerance: Largest error that will do, as a fraction.
        grounds: What is known of all levels.
    """
    found = []
    if not one.inside(tolerance):
        found.append(f"{one.level.name} {_off_words(one)}")
    uncertain = grounds.uncertainty
    sums = {group: error + uncertain.get(group, 0.0) for group, error in one.errors.items()}
    worst = max(uncertain, key=lambda group: uncertain[group], default="")
    largest = max(sums, key=lambda group: sums[group], default="")
    if uncertain.get(worst, 0.0) > tolerance:
        found.append(f"the reference itself is uncertain by {percent(uncertain[worst])} ({worst})")
    elif one.inside(tolerance) and sums.get(largest, 0.0) > tolerance:
        found.append(f"its error and the uncertainty of the reference add up to {percent(sums[largest])} ({largest})")
    if one.covered < WHOLE * grounds.end:
        found += _span_doubts(one, tolerance, grounds)
    return found


def _span_doubts(one: Judged, tolerance: float, grounds: Grounds) -> list[str]:
    """Return the doubts about a level whose errors do not cover the whole case."""
    if not grounds.chaotic:
        reason = f": {grounds.cut}" if grounds.cut else ", as it was too dear to follow longer"
        return [f"errors cover the first {one.covered:.3g} s of {grounds.end:.4g} s only{reason}"]
    known = inf if one.means is None else one.means
    if known <= tolerance:
        return []
    words = "are not known" if not isfinite(known) else f"are known to {percent(known)} only"
    return [f"the motion can be predicted for {one.covered:.3g} s only, and means beyond that {words}"]


def _off(one: Judged) -> float:
    """Return the larger of error and excess of the long means."""
    return max(one.error, one.statistics or 0.0)


def _off_words(one: Judged) -> str:
    if not isfinite(_off(one)):
        return "is in another cycle than the reference"
    worst = max(one.errors, key=lambda group: one.errors[group], default="")
    where = worst if one.error >= (one.statistics or 0.0) else "means over windows"
    return f"is {percent(_off(one))} off the reference ({where})"


def percent(fraction: float) -> str:
    """Return a fraction in percent, with two digits; large ones in whole percent."""
    return f"{100.0 * fraction:.0f} %" if fraction > 0.995 else f"{100.0 * fraction:.2g} %"
