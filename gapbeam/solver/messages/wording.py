"""Words of messages: options, counted nouns, close numbers set apart, text on one line, and likely meanings."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Iterable
from math import inf, isfinite
from pathlib import Path

LOG = logging.getLogger("gapbeam")
"""The terminal's messages and run.log."""


def either(options: Iterable[str]) -> str:
    """Return "a, b or c"."""
    *first, last = options
    return f"{', '.join(first)} or {last}" if first else last


def counted(number: int, noun: str) -> str:
    """Return "1 row", "2 rows" or "2 entries"."""
    many = f"{noun[:-1]}ies" if noun.endswith("y") and noun[-2] not in "aeiou" else f"{noun}s"
    return f"{number} {noun if number == 1 else many}"


def printable(text: object, longest: int = 60) -> str:
    """Return a text for one line of a message: not too long, without control characters."""
    cut = str(text)[:longest] + "..." * (len(str(text)) > longest)
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in cut)


ROUND_OFF = 1.0e-9  # relative; sums and differences of what people type are that exact
USUAL_DIGITS, ALL_DIGITS = 6, 17


def exceeds(value: float, limit: float, scale: float = 0.0, round_off: float = ROUND_OFF) -> bool:
    """Return whether a value is above a limit by more than round-off: 0.3 - 0.2 is not above 0.1.

    Args:
        value: The value.
        limit: The limit.
        scale: Size of the numbers that both are differences of, such as the coordinates of the ends of a length.
        round_off: Relative difference that counts as none.
    """
    return value - limit > round_off * max(abs(value), abs(limit) if abs(limit) < inf else 0.0, abs(scale))


def apart(value: float, limit: float, round_off: float = ROUND_OFF, least: int = USUAL_DIGITS) -> tuple[str, str]:
    """Return two numbers with as many digits as tell them apart; those equal to round-off, alike.

    Args:
        value: The value.
        limit: The limit.
        round_off: Relative difference that counts as none.
        least: Least number of digits.
    """
    if not (isfinite(value) and isfinite(limit)):
        return f"{value:g}", f"{limit:g}"
    if not (exceeds(value, limit, 0.0, round_off) or exceeds(limit, value, 0.0, round_off)):
        return f"{value:g}", f"{value:g}"
    for digits in range(least, ALL_DIGITS + 1):
        words = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if words[0] != words[1]:
            return words
    return words


SYNONYMS = {
    "e": "young_modulus",
    "modulus": "young_modulus",
    "elastic_modulus": "young_modulus",
    "nu": "poisson_ratio",
    "poisson": "poisson_ratio",
    "rho": "density",
    "l": "length",
    "height": "thickness",
    "h": "thickness",
    "b": "width",
    "diameter": "thickness",
    "outer_diameter": "thickness",
    "outer": "thickness",
    "od": "thickness",
    "d": "thickness",
    "depth": "thickness",
    "wall_thickness": "wall",
    "inner": "wall",
    "inner_diameter": "wall",
    "start": "from",
    "begin": "from",
    "stop": "to end",
    "end": "to",
    "t": "end",
    "tmax": "end",
    "t_max": "end",
    "at": "point from",
    "zeta": "ratio ratios",
    "spring": "stiffness",
    "damper": "damping",
    "gap_size": "clearance",
    "initial_gap": "clearance",
    "mu_s": "static_friction",
    "filename": "file",
    "path": "file",
    "data": "file",
    "mu": "coefficient",
    "friction_coefficient": "coefficient",
    "amp": "amplitude",
    "gap": "clearance",
    "play": "clearance",
    "interference": "clearance",
    "penalty": "stiffness",
    "k": "stiffness",
    "c": "damping",
    "dim": "dimension",
    "order": "degree",
    "element": "cell",
    "freq": "frequency",
    "f": "frequency",
    "force": "amplitude",
    "position": "point from",
    "location": "point from",
    "coordinates": "point from",
    "x": "point from",
    "length": "to",
    "g": "acceleration",
    "dt": "step",
    "time_step": "step",
    "t_end": "end",
    "duration": "end",
    "integrator": "scheme",
    "method": "scheme",
    "spectral_radius": "rho_inf",
}
"""Names of our keys in papers and other programs; one word may stand for several keys, of different tables."""


def near(word: object, known: Iterable[str]) -> str | None:
    """Return the known word that was probably meant, or None."""
    names = list(known)
    return same(word, names) or close_to(word, names)


def near_file(name: str, others: Iterable[str]) -> str | None:
    """Return the file that was probably meant, by names without suffixes; one of the same suffix before others."""
    suffix = Path(name).suffix
    stems = {Path(one).stem: one for one in sorted(others, key=lambda one: Path(one).suffix == suffix)}
    close = near(Path(name).stem, stems)
    return None if close is None else stems[close]


def same(word: object, known: list[str]) -> str | None:
    """Return the known word that differs only in case and hyphens, or that the typed one is a synonym of."""
    typed = _plain(word)
    meant = (typed, *SYNONYMS.get(typed, "").split())
    return next((name for name in known if _plain(name) in meant), None)


def close_to(word: object, known: list[str], alike: float = 0.6) -> str | None:
    """Return the known word that begins alike or is spelled much alike, of three letters or more, or None.

    Args:
        word: The word as typed.
        known: Known words.
        alike: Least likeness of the spelling, 0 to 1.
    """
    plain = {_plain(name): name for name in known}
    if len(_plain(word)) < 3:
        return None
    begins = [name for name in known if _plain(name).startswith(_plain(word))]
    if len(begins) == 1:
        return begins[0]
    close = difflib.get_close_matches(_plain(word), plain, n=1, cutoff=alike)
    return plain[close[0]] if close else None


def _plain(word: object) -> str:
    return f"{word!s:.60}".strip().lower().replace("-", "_").replace(" ", "_")


def is_numeric(text: str) -> bool:
    """Return whether a text is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True
