"""The unit of a key of a case, as its description ends: ", m/s^2", where a remark may follow behind ";"."""

from __future__ import annotations

import re

UNITS = (
    "m", "s", "N", "GB", "Hz", "Pa", "Pa/m", "Pa s/m", "N/m", "N s/m", "1/s", "m/s", "kg", "kg/m", "N s/m^2", "kg m^2",
    "N m/rad", "N m s/rad", "kg/m^3", "m/s^2", "m/s^2, m/s or m", "N or m/s^2", "N^2/Hz or (m/s^2)^2/Hz", "no unit",
    "degrees", "rad", "rad/s", "m^2", "1/Pa", "in the unit of the key",
)  # fmt: skip
"""Units that descriptions end with."""

_ENDING = re.compile(f", ({'|'.join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))})(?= \\(|;|$)")


def unit_in(description: str) -> str:
    """Return the unit that a description of a key ends with; "" where it has none."""
    found = _ENDING.search(description)
    return found[1] if found else ""
