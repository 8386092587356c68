"""Two numbers that are compared: equal to round-off or not, and in words that differ where the numbers do."""

from __future__ import annotations

from math import inf, isfinite

ROUND_OFF = 1.0e-9  # relative; sums and differences of what people type are that exact
USUAL_DIGITS, ALL_DIGITS = 6, 17


def exceeds(value: float, limit: float, scale: float = 0.0, round_off: float = ROUND_OFF) -> bool:
    """Return whether a value is above a limit by more than round-off: 0.3 - 0.2 is not above 0.1.

    Args:
        value: The value.
        limit: The limit.
        scale: What both are differences of, such as the coordinates of the ends of a length.
        round_off: Relative difference that is none.
    """
    return value - limit > round_off * max(abs(value), abs(limit) if abs(limit) < inf else 0.0, abs(scale))


def apart(value: float, limit: float, round_off: float = ROUND_OFF) -> tuple[str, str]:
    """Return two numbers with as many digits, at least six, as tell them apart; those equal to round-off, alike.

    Args:
        value: The value.
        limit: What it is compared with.
        round_off: Relative difference that is none.
    """
    if not (isfinite(value) and isfinite(limit)):
        return f"{value:g}", f"{limit:g}"
    if not (exceeds(value, limit, 0.0, round_off) or exceeds(limit, value, 0.0, round_off)):
        return f"{value:g}", f"{value:g}"
    for digits in range(USUAL_DIGITS, ALL_DIGITS + 1):
        words = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if words[0] != words[1]:
            return words
    return words
