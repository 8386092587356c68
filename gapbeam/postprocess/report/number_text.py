"""Numbers as readers of a page want them: significant digits, a true minus sign, powers of ten."""

from __future__ import annotations

import math

from gapbeam.postprocess.report.blocks import Cell

MINUS = "\N{MINUS SIGN}"
ABSENT = "\N{EN DASH}"
TIMES = "\N{NO-BREAK SPACE}×\N{NO-BREAK SPACE}"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN = range(-3, 6)  # powers of ten of numbers that are written without them


def number(value: float, digits: int = 4) -> str:
    """Return a number to significant digits: 0.01235, −1.235 × 10⁻⁵, 123 500.

    Args:
        value: Integers are written whole; what is not finite is a dash.
        digits: Of numbers that are no integers.
    """
    if isinstance(value, int):
        return _grouped(str(value))
    if not math.isfinite(value):
        return ABSENT
    if value == 0.0:
        return "0"
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    if int(power) in _PLAIN:
        return _grouped(f"{float(f'{mantissa}e{power}'):.{max(digits - 1 - int(power), 0)}f}")
    return f"{mantissa}{TIMES}10{str(int(power)).translate(_RAISED)}".replace("-", MINUS)


def cell(value: Cell, digits: int = 4) -> str:
    """Return a cell of a table as text; nothing is a dash."""
    if value is None:
        return ABSENT
    return value if isinstance(value, str) else number(value, digits)


def percent(fraction: float | None, signed: bool = True) -> str:
    """Return a fraction in percent to two significant digits, whole percents where it is large."""
    if fraction is None or not math.isfinite(fraction):
        return ABSENT
    value = 100.0 * fraction
    if abs(value) < 0.005:
        return "0 %"
    size = number(float(f"{abs(value):.2g}"), 2) if abs(value) < 100.0 else _grouped(f"{abs(value):.0f}")
    sign = MINUS if value < 0.0 else "+" if signed else ""
    return f"{sign}{size} %"


def _grouped(text: str) -> str:
    """Set a thin space between the thousands of five digits and more."""
    whole, point, rest = text.partition(".")
    sign, whole = ("-", whole[1:]) if whole.startswith("-") else ("", whole)
    if len(whole) > 4:
        whole = f"{int(whole):,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
    return f"{sign}{whole}{point}{rest}".replace("-", MINUS)
