"""What a mistyped or misplaced key or name of a case file probably meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from pydantic import BaseModel

from solver.case import Case
from solver.case_file.keys import header, models_in, tables
from solver.case_file.words import either

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
}
"""What papers and other programs call our keys."""


def near(word: object, known: Iterable[str]) -> str | None:
    """Return the known word that was probably meant, or None."""
    names = list(known)
    return _same(word, names) or _close(word, names)


def meant(name: str, model: type[BaseModel], root: type[BaseModel] = Case) -> str:
    """Return a hint for an unknown key: a near miss in its table, or the table where it belongs; "" if none.

    Args:
        name: The key as written.
        model: The table it was found in.
        root: Model of the whole file.
    """
    own = list(model.model_fields)
    every = sorted({key for table in tables(root) for key in table.model.model_fields})
    word = _same(name, own) or (None if _same(name, every) else _close(name, own))
    if word:
        is_table = model is root and models_in(model.model_fields[word].annotation)
        return f"did you mean {header((word,), {}, root) if is_table else f'`{word}`'}?"
    word = near(name, every)
    if not word:
        return ""
    homes = [table for table in tables(root) if word in table.model.model_fields]
    here = {table.header for table in tables(root) if table.model is model}
    homes = [table for table in homes if table.header in here] or homes  # another type of the same table is nearest
    places = dict.fromkeys(str(home) if len(homes) < 4 else home.header for home in homes)
    if word == name:
        return f"`{name}` belongs in {either(places)}"
    return f"did you mean `{word}`, which belongs in {either(places)}?"


def _same(word: object, known: list[str]) -> str | None:
    """Return the known word that differs only in case and hyphens, or that the typed one is a synonym of."""
    typed = _plain(word)
    return next((name for name in known if _plain(name) in (typed, SYNONYMS.get(typed))), None)


def _close(word: object, known: list[str]) -> str | None:
    plain = {_plain(name): name for name in known}
    begins = [name for name in known if len(_plain(word)) > 2 and _plain(name).startswith(_plain(word))]
    if len(begins) == 1:
        return begins[0]
    close = difflib.get_close_matches(_plain(word), plain, n=1, cutoff=0.6)
    return plain[close[0]] if close else None


def _plain(word: object) -> str:
    return f"{word!s:.60}".strip().lower().replace("-", "_").replace(" ", "_")
