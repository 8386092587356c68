"""The tables and keys that a case file, or a file like one, may hold: read off its models.

The root is the model of the whole file, by default `gapbeam.solver.case.case.Case`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple

from pydantic import BaseModel

from gapbeam.solver.case.case import Case
from gapbeam.solver.faults import Key
from gapbeam.solver.table import array_models, models_in, type_name
from gapbeam.solver.wording.short_words import printable


class KeyTable(NamedTuple):
    """A table of the case file: its header, its model, and its type where several share the header."""

    header: str
    model: type[BaseModel]
    kind: str

    def __str__(self) -> str:
        return f'{self.header} of type "{self.kind}"' if self.kind else self.header


@cache
def tables(root: type[BaseModel] = Case) -> tuple[KeyTable, ...]:
    """Return all tables in the order of the file, those inside another table right after it."""
    return tuple(_tables_in(root, (), root))


def _tables_in(model: type[BaseModel], inside: Key, root: type[BaseModel]) -> Iterator[KeyTable]:
    for name, field in model.model_fields.items():
        entries = array_models(field.annotation)
        for inner in models_in(field.annotation):
            data: dict[str, Any] = {name: [{}] if inner in entries else {}}
            yield KeyTable(header((*inside, name), {} if inside else data, root), inner, type_name(inner))
            yield from _tables_in(inner, (*inside, name), root)


def is_array(name: object, data: object = None, root: type[BaseModel] = Case) -> bool:
    """Return True for the name of an array of tables, such as [[load]], or [[support]] where the data have several.

    Args:
        name: Of the table.
        data: The case file as read; it decides where a name is that of a table or of an array.
        root: Model of the whole file.
    """
    if name not in root.model_fields:
        return False
    annotation = root.model_fields[str(name)].annotation
    entries = array_models(annotation)
    either = len(entries) < len(models_in(annotation))
    return bool(entries) and (not either or isinstance(_inside(data, str(name)), list | tuple))


def numbered(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables with every array of tables as {number: entry}."""
    return {name: dict(enumerate(t)) if isinstance(t, tuple) else t for name, t in tables.items()}


def candidates(key: Key, data: object, root: type[BaseModel] = Case) -> list[type[BaseModel]]:
    """Return the models that the table at a key may have: several where the type in a union is not known.

    Args:
        key: The way to the table; () is the whole case.
        data: The case file as read: it says of what type a load or scheme is.
        root: Model of the whole file.
    """
    models: list[type[BaseModel]] = [root]
    for part in key:
        data = _inside(data, part)
        if isinstance(part, str):
            fields = [model.model_fields[part] for model in models if part in model.model_fields]
            models = list(dict.fromkeys(inner for field in fields for inner in _of_form(field.annotation, data)))
        chosen = data if isinstance(data, str) else _inside(data, "type")
        models = [model for model in models if len(models) > 1 and type_name(model) == chosen] or models
    return models


def _of_form(annotation: object, data: object) -> list[type[BaseModel]]:
    """Return the models of an annotation; where it takes a table or an array of others, those that the data ask for."""
    models, entries = models_in(annotation), array_models(annotation)
    if not entries or len(entries) == len(models):
        return models
    return entries if isinstance(data, list | tuple) else [model for model in models if model not in entries]


def value_at(key: Key, data: object) -> object:
    """Return the value at a key, or None where there is nothing."""
    for part in key:
        data = _inside(data, part)
    return data


def _inside(data: object, part: str | int) -> object:
    if isinstance(data, Mapping):
        return data.get(part)
    if isinstance(data, list | tuple) and isinstance(part, int) and 0 <= part < len(data):
        return data[part]
    return None


def flat(value: Any, key: str = "") -> dict[str, Any]:
    """Return a nested table, such as a case as plain data, as dotted keys; entries of arrays by names or numbers."""
    if isinstance(value, dict):
        entries = ((name, inner) for name, inner in value.items())
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        entries = ((str(entry.get("name", place)), entry) for place, entry in enumerate(value))
    else:
        return {key: value if not (isinstance(value, float) and not math.isfinite(value)) else repr(value)}
    found: dict[str, Any] = {}
    for name, inner in entries:
        found |= flat(inner, f"{key}.{name}" if key else name)
    return found


def label(key: Key, data: object, root: type[BaseModel] = Case) -> str:
    """Return a key as a person names it: [support] clearance, [[load]] number 2 (name "shaker") amplitude."""
    if not key:
        return "the whole case"
    value = value_at(key, data)
    is_table = isinstance(value, Mapping) or (value is None and bool(candidates(key, data, root)))
    if is_table or isinstance(key[-1], int):
        return header(key, data, root)
    if isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
        return f"[[{printable(key[-1])}]]"
    return f"{header(key[:-1], data, root)} {printable(key[-1])}".strip()


def header(key: Key, data: object, root: type[BaseModel] = Case) -> str:
    """Return the header of the table at a key, with the number and name of an entry of an array of tables."""
    if not key:
        return ""
    if len(key) == 1:
        return f"[[{key[0]}]]" if is_array(key[0], data, root) else f"[{printable(key[0])}]"
    if isinstance(key[1], int):
        name = value_at((*key[:2], "name"), data)
        named = f' (name "{printable(name)}")' if isinstance(name, str) else ""
        return " ".join([f"[[{key[0]}]] number {key[1] + 1}{named}", *map(printable, key[2:])])
    return f"[{'.'.join(map(printable, key))}]"
