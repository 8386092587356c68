"""Bias of the figures of a rattling mass under noise by scheme and steps per contact.

The exact law is that of a mass on a spring before one stop 100 times as stiff, with white noise. Differences within two
standard errors of chance are 0. Measured by `python3 -m benchmarks.scheme_bias`, docs/benchmarks/statistics.md.
"""

from __future__ import annotations

from math import log2
from typing import NamedTuple

SECOND_ORDER = 0.25  # of a bias is left at half the step


class NoiseBias(NamedTuple):
    """Relative bias of the figures of a rattling mass.

    Attributes:
        steps: In the duration of a contact.
        mean_square: Of its place.
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
        steps: In the duration of a contact, > 0.
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
