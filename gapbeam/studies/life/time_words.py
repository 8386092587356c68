"""Times from seconds to years, in words and from them."""

from __future__ import annotations

import re

YEAR = 365.25 * 86_400.0  # s, a Julian year
UNITS = {"years": YEAR, "days": 86_400.0, "h": 3600.0, "s": 1.0}
LETTERS = {"y": YEAR, "d": 86_400.0, "h": 3600.0, "m": 60.0, "s": 1.0, "": 1.0}


def time_words(seconds: float) -> str:
    """Return a time in the largest unit of which there is one at least: 12.3 years, 40 days, 3 h, 20 s."""
    unit = next((name for name, size in UNITS.items() if seconds >= size), "s")
    return f"{seconds / UNITS[unit]:.3g} {unit}"


def long_time(text: str) -> float | None:
    """Return a time such as 40y, 300d, 2000h or 90 (seconds), s; None: it is none."""
    parts = re.fullmatch(r"(\d+(?:\.\d*)?(?:e\d+)?)([ydhms]?)", text.strip())
    if parts is None or float(parts[1]) <= 0.0:
        return None
    return float(parts[1]) * LETTERS[parts[2]]
