"""Units in which figures and tables show SI values."""

from __future__ import annotations

from gapbeam.solver.schema.record_table import STANDARD_GRAVITY

# SI unit: (unit shown, factor)
DISPLAY: dict[str, tuple[str, float]] = {
    "m": ("mm", 1.0e3),
    "m/s": ("mm/s", 1.0e3),
    "m/s^2": ("g", 1.0 / STANDARD_GRAVITY),
    "J": ("mJ", 1.0e3),
    "Pa": ("MPa", 1.0e-6),
    "N": ("N", 1.0),
}


def shown(unit: str) -> tuple[str, float]:
    """The unit shown for an SI unit and the factor to it; the unit itself where we have no other."""
    return DISPLAY.get(unit, (unit, 1.0))
