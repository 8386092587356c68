"""Units in which figures and tables show SI values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.schema.record_table import STANDARD_GRAVITY

# SI unit: (unit shown, factor) where the size of the values is not known
DISPLAY: dict[str, tuple[str, float]] = {
    "m": ("mm", 1.0e3),
    "m/s": ("mm/s", 1.0e3),
    "m/s^2": ("g", 1.0 / STANDARD_GRAVITY),
    "J": ("mJ", 1.0e3),
    "Pa": ("MPa", 1.0e-6),
    "N": ("N", 1.0),
}
# SI unit: its prefixes, the largest first; and the least value that is shown in the unit with that prefix
PREFIXES: dict[str, tuple[tuple[str, float], ...]] = {
    "m": (("", 1.0), ("m", 1.0e-5), ("µ", 1.0e-8), ("n", 1.0e-12), ("", 0.0)),
    "m/s": (("", 10.0), ("m", 1.0e-5), ("µ", 1.0e-8), ("n", 1.0e-12), ("", 0.0)),
    "J": (("M", 1e7), ("k", 1e4), ("", 1.0), ("m", 1e-5), ("µ", 1e-8), ("n", 1e-11), ("p", 1e-15), ("", 0.0)),
    "Pa": (("G", 1.0e10), ("M", 1.0e4), ("k", 10.0), ("", 0.0)),
    "N": (("M", 1.0e7), ("k", 1.0e4), ("", 0.01), ("m", 1.0e-5), ("µ", 1.0e-8), ("n", 1.0e-12), ("", 0.0)),
    "s": (("", 10.0), ("m", 1.0e-3), ("µ", 1.0e-6), ("n", 0.0)),
    "rad": (("", 1.0e-2), ("m", 1.0e-5), ("µ", 1.0e-9), ("", 0.0)),
}
PREFIXES |= {"N m": PREFIXES["N"], "N s": PREFIXES["J"], "N m s": PREFIXES["J"], "rad/s": PREFIXES["rad"]}
POWERS = {"G": 1.0e-9, "M": 1.0e-6, "k": 1.0e-3, "": 1.0, "m": 1.0e3, "µ": 1.0e6, "n": 1.0e9, "p": 1.0e12}


def shown(unit: str, largest: float = 0.0) -> tuple[str, float]:
    """The unit shown for an SI unit and the factor to it; the unit itself where we have no other.

    Args:
        unit: SI unit.
        largest: Largest of the values shown, in that unit, which chooses the prefix; 0: that of `DISPLAY`.
    """
    if largest:
        for prefix, least in PREFIXES.get(unit, ()):
            if abs(largest) >= least:
                return prefix + unit, POWERS[prefix]
    return DISPLAY.get(unit, (unit, 1.0))


def shown_by(unit: str, values: Iterable[float | None]) -> tuple[str, float]:
    """The unit in which values are shown together, by the largest of those that are known, and the factor to it.

    Args:
        unit: SI unit.
        values: Values in that unit.
    """
    return shown(unit, max((abs(one) for one in values if one is not None and isfinite(one)), default=0.0))


def sized_columns(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
    """Return a table whose columns with an SI unit at the end of their head, "force (N)", have the unit of their size.

    Args:
        heads: Heads of the columns.
        rows: Cells; what is no float stays.
    """
    named, columns = list[str](), list[list[Any]]()
    for head, column in zip(heads, zip(*rows, strict=True), strict=True):
        name, _, unit = head.removesuffix(")").rpartition(" (")
        known = bool(name) and unit in PREFIXES
        label, factor = shown_by(unit, (one for one in column if isinstance(one, float))) if known else (unit, 1.0)
        named.append(f"{name} ({label})" if known else head)
        columns.append([factor * one if known and isinstance(one, float) else one for one in column])
    return (tuple(named) if rows else tuple(heads)), list(zip(*columns, strict=True))


def shown_along(places: Iterable[ArrayLike]) -> tuple[str, float]:
    """The unit in which places along a beam are shown, by how far they reach, and the factor to it.

    Args:
        places: Places, m, of several faces or states.
    """
    every = np.concatenate([np.zeros(0), *(np.ravel(np.asarray(some, dtype=float)) for some in places)])
    low, high = (float(every.min()), float(every.max())) if every.size else (0.0, 0.0)
    return shown("m", 0.1 * (high - low or high))


def size_words(value: float, digits: int = 4, unit: str = "m") -> str:
    """Return a value with the unit in which it is read best.

    Args:
        value: Value, such as a length.
        digits: Significant digits.
        unit: SI unit of the value.
    """
    unit, factor = shown(unit, value)
    return f"{factor * value:.{digits}g} {unit}".replace("-", "−")


IN_WORDS = re.compile(r"(?<![\w.+-])(\d[\d.]*(?:e[+-]\d+)?) (m|Hz)(?![\w/^*])")


def words_by_size(text: str) -> str:
    """Return a text whose lengths and frequencies are in the units in which they are read best, of ASCII letters.

    Args:
        text: Text with SI values, such as "h = 2.9e-07 m".
    """

    def by_size(found: re.Match[str]) -> str:
        value, unit = float(found[1]), found[2]
        digits = max(len(re.sub(r"e.*|\.|^[0.]+", "", found[1])), 3)
        if unit == "Hz":
            prefix = next((one for one, least in (("M", 1.0e6), ("k", 1.0e4)) if value >= least), "")
            return f"{POWERS[prefix] * value:.{digits}g} {prefix}Hz"
        return size_words(value, digits).replace("−", "-").replace("µ", "u")

    return IN_WORDS.sub(by_size, text)


def in_percent(fraction: float) -> str:
    """Return a fraction in percent, with two digits; large ones in whole percent."""
    return f"{100.0 * fraction:.0f} %" if fraction > 0.995 else f"{100.0 * fraction:.2g} %"


def finite_or_none(value: float | None) -> float | None:
    """Return a number as JSON can hold it: None where it is not finite."""
    return value if value is not None and isfinite(value) else None


def rounded_down(limit: float, steps: Sequence[float] = (1.0, 2.0, 5.0, 10.0)) -> float:
    """Return the largest of some steps times a power of ten that does not exceed a limit above 0."""
    decade = 10.0 ** np.floor(np.log10(limit))
    return float(max(step for step in steps if step * decade <= limit * (1.0 + 1e-9)) * decade)
