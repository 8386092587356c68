"""Suggestions for mistyped or misplaced keys and names of a case file."""

from __future__ import annotations

from pydantic import BaseModel

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.known_keys import header, tables
from gapbeam.solver.table import models_in
from gapbeam.solver.wording.short_words import close_to, either, near, same


def meant(name: str, model: type[BaseModel], root: type[BaseModel] = Case) -> str:
    """Return a hint for an unknown key: a near miss in its table, or the table where it belongs; "" if none.

    Args:
        name: The key as written.
        model: The table it was found in.
        root: Model of the whole file.
    """
    own = list(model.model_fields)
    every = sorted({key for table in tables(root) for key in table.model.model_fields})
    word = same(name, own) or (None if same(name, every) else close_to(name, own))
    if word:
        is_table = model is root and models_in(model.model_fields[word].annotation)
        return f"did you mean {header((word,), {}, root) if is_table else f'`{word}`'}?"
    word = near(name, every)
    if not word:
        return ""
    homes = [table for table in tables(root) if word in table.model.model_fields]
    here = {table.header for table in tables(root) if table.model is model}
    homes = [table for table in homes if table.header in here] or homes  # another type of the same table is nearest
    names = {table.strip("[]") for table in here}
    homes = [table for table in homes if table.header.strip("[]") in names] or homes  # or another form of it
    types = {
        home.header: [f'"{one.kind}"' for one in homes if one.header == home.header and one.kind] for home in homes
    }
    places = [f"{table} of type {either(dict.fromkeys(kinds))}" if kinds else table for table, kinds in types.items()]
    if word == name:
        return f"`{name}` belongs in {either(places)}"
    return f"did you mean `{word}`, which belongs in {either(places)}?"
