"""Two numbers that are compared: equal to round-off or not, and in words that differ where the numbers do."""

from __future__ import annotations

from math import inf, isfinite

ROUND_OFF = 1.0e-9  # relative; sums and differences of what people type are that exact
USUAL_DIGITS, ALL_DIGITS = 6, 17


def exceeds(value: float, limit: float, scale: float = 0.0) -> bool:
    """Return whether a value is above a limit by more than round-off: 0.3 - 0.2 is not above 0.1.

    Args:
        value: The value.
        limit: The limit.
        scale: What both are differences of, such as the coordinates of the ends of a length.
    """
    return value - limit > ROUND_OFF * max(abs(value), abs(limit) if abs(limit) < inf else 0.0, abs(scale))


def apart(value: float, limit: float) -> tuple[str, str]:
    """Return two numbers with as many digits, at least six, as tell them apart; those equal to round-off, alike."""
    if not (isfinite(value) and isfinite(limit)):
        return f"{value:g}", f"{limit:g}"
    if not (exceeds(value, limit) or exceeds(limit, value)):
        return f"{value:g}", f"{value:g}"
    for digits in range(USUAL_DIGITS, ALL_DIGITS + 1):
        words = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if words[0] != words[1]:
            return words
    return words
