"""The known name that a mistyped one was probably meant to be."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

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
    "position": "point",
    "location": "point",
    "coordinates": "point",
    "x": "point",
    "g": "acceleration",
    "dt": "step",
    "time_step": "step",
    "t_end": "end",
    "duration": "end",
    "integrator": "scheme",
    "method": "scheme",
    "spectral_radius": "rho_inf",
}
"""What papers and other programs call our keys."""


def near(word: object, known: Iterable[str]) -> str | None:
    """Return the known word that was probably meant, or None."""
    names = list(known)
    return same(word, names) or close_to(word, names)


def same(word: object, known: list[str]) -> str | None:
    """Return the known word that differs only in case and hyphens, or that the typed one is a synonym of."""
    typed = _plain(word)
    return next((name for name in known if _plain(name) in (typed, SYNONYMS.get(typed))), None)


def close_to(word: object, known: list[str]) -> str | None:
    """Return the known word that begins alike or is spelled much alike, or None."""
    plain = {_plain(name): name for name in known}
    begins = [name for name in known if len(_plain(word)) > 2 and _plain(name).startswith(_plain(word))]
    if len(begins) == 1:
        return begins[0]
    close = difflib.get_close_matches(_plain(word), plain, n=1, cutoff=0.6)
    return plain[close[0]] if close else None


def _plain(word: object) -> str:
    return f"{word!s:.60}".strip().lower().replace("-", "_").replace(" ", "_")
