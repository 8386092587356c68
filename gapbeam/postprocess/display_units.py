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
# least length, m: (unit shown, factor)
LENGTHS = ((1.0, ("m", 1.0)), (1.0e-5, ("mm", 1.0e3)), (1.0e-8, ("µm", 1.0e6)), (0.0, ("nm", 1.0e9)))


def shown(unit: str, largest: float = 0.0) -> tuple[str, float]:
    """The unit shown for an SI unit and the factor to it; the unit itself where we have no other.

    Args:
        unit: SI unit.
        largest: Largest of the values shown, in that unit: lengths are in m, mm, µm or nm by it; 0: in mm.
    """
    if unit == "m" and largest:
        return next((chosen for least, chosen in LENGTHS if abs(largest) >= least), DISPLAY[unit])
    return DISPLAY.get(unit, (unit, 1.0))


def length_words(value: float, digits: int = 4) -> str:
    """Return a length with the unit in which it is read best.

    Args:
        value: Length, m.
        digits: Significant digits.
    """
    unit, factor = shown("m", value)
    return f"{factor * value:.{digits}g} {unit}".replace("-", "−")
