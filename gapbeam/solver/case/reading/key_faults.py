"""Faults of single keys, put in words: unknown, missing, of the wrong type, out of range."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.known_keys import (
    candidates,
    header,
    is_array,
    numbered,
    value_at,
)
from gapbeam.solver.case.reading.suggestions import meant
from gapbeam.solver.case.reading.value_hints import hint_for
from gapbeam.solver.case.reading.value_words import example, shown, toml_value, wanted
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.table import FORMS, array_models, models_in, type_name
from gapbeam.solver.wording.short_words import either, near, printable

MOST_FAULTS = 100


@cache
def _adapters(root: type[BaseModel]) -> dict[str, TypeAdapter[Any]]:
    return {name: TypeAdapter(field.rebuild_annotation()) for name, field in root.model_fields.items()}


def check_types(data: Mapping[str, Any], root: type[BaseModel] = Case) -> tuple[dict[str, Any], list[Fault]]:
    """Check every key by itself.

    Args:
        data: The file as read.
        root: Model of the whole file.

    Returns:
        The tables that are intact, arrays of tables as {number: entry}; and the faults.
    """
    try:
        return numbered(dict(root.model_validate(data))), []
    except ValidationError as error:
        keys = dict.fromkeys(_key(location, data, root) for location in _innermost(error))
    words = _without_echoes(list(keys)[:MOST_FAULTS], data, root)
    others = _of_the_other_form(data, keys, root)
    known = {fault.key for fault in others}
    intact = {name: table for name, table in _intact(data, keys, root).items() if (name,) not in known}
    return intact, [*others, *(_fault(key, data, root) for key in words if key[:1] not in known)]


def incomplete(faults: Iterable[Fault], data: Mapping[str, Any], root: type[BaseModel] = Case) -> frozenset[str]:
    """Return the arrays of tables of which an entry has a fault of its own."""
    return frozenset(str(one.key[0]) for one in faults if len(one.key) > 1 and is_array(one.key[0], data, root))


def _innermost(error: ValidationError) -> list[tuple[int | str, ...]]:
    """Return the locations of faults, without those of a table or list around another: its form is what was asked for.

    An array counts its sound entries only: with a fault in its last one, it is too short besides.
    """
    places = [detail["loc"] for detail in error.errors(include_url=False)]
    around = {place[:size] for place in places for size in range(len(place))}
    return [place for place in places if place not in around]


def _intact(data: Mapping[str, Any], faulty: Iterable[Key], root: type[BaseModel]) -> dict[str, Any]:
    """Return the tables and entries without a faulty key, as models."""
    adapters = _adapters(root)
    broken = {key[:size] for key in faulty for size in (1, 2)}
    whole = {name: value for name, value in data.items() if (name,) not in broken and name in adapters}
    tables = numbered({name: adapters[name].validate_python(value) for name, value in whole.items()})
    for name, field in root.model_fields.items():
        if name in data and is_array(name, data, root) and (name,) in broken and isinstance(data[name], list):
            sound = {i: [entry] for i, entry in enumerate(data[name]) if (name, i) not in broken}
            tables[name] = {i: adapters[name].validate_python(entry)[0] for i, entry in sound.items()}
        elif name not in data and not field.is_required():
            tables |= numbered({name: field.get_default()})
    return tables


def _key(location: tuple[int | str, ...], data: Mapping[str, Any], root: type[BaseModel]) -> Key:
    """Return the key that pydantic's location speaks of, without union members and items of lists."""
    key: Key = ()
    chosen = False  # the member of the union at the key: its name is no key, even where it is also that of a key
    for part in location:
        models = candidates(key, data, root)
        if len(key) == 1 and part in FORMS and array_models(root.model_fields[str(key[0])].annotation):
            continue
        if isinstance(part, int) and not (len(key) == 1 and is_array(key[0], data, root)):
            break
        if not chosen and isinstance(part, str) and part in map(type_name, models):
            chosen = True
            continue
        key, chosen = (*key, part), False
        if not candidates(key, data, root):
            break
    return key


def _without_echoes(keys: list[Key], data: Mapping[str, Any], root: type[BaseModel]) -> list[Key]:
    """Leave out each missing key for which an unknown key was meant: that is one mistake."""
    missing = [key for key in keys if _is_missing(key, data)]
    meant_here = set()
    for *table, name in (key for key in keys if _is_unknown(key, data, root)):
        meant_here.add((*table, near(name, [str(key[-1]) for key in missing if list(key[:-1]) == table])))
    return [key for key in keys if key not in missing or key not in meant_here]


def _is_missing(key: Key, data: Mapping[str, Any]) -> bool:
    table = value_at(key[:-1], data)
    return isinstance(table, Mapping) and key[-1] not in table


def _is_unknown(key: Key, data: Mapping[str, Any], root: type[BaseModel]) -> bool:
    owners = candidates(key[:-1], data, root)
    return isinstance(key[-1], str) and not any(key[-1] in model.model_fields for model in owners)


def _fault(key: Key, data: Mapping[str, Any], root: type[BaseModel]) -> Fault:
    value, name = value_at(key, data), str(key[-1])
    models, owners = candidates(key, data, root), candidates(key[:-1], data, root)
    if len(models) > 1 and not is_array(name, data, root):
        return _union_fault(key, value, models)
    if _is_unknown(key, data, root):
        return _unknown_key(key, value, owners[0], root)
    if models and not _is_missing(key, data):
        return _not_a_table(key, value, models[0], data, root)
    if models:
        keys = [field for field, info in models[0].model_fields.items() if info.is_required()]
        hint = f"add {header(key, data, root)} with {', '.join(example(models[0], field) for field in keys)}"
        return Fault(key, "no such table", f"{header(key, data, root)} with {', '.join(keys)}", hint)
    if _is_missing(key, data):
        line = example(owners[0], name)
        return Fault(key, "nothing: the key is missing", wanted(owners[0], name), f"add {line}" if line else "")
    return Fault(key, shown(value), wanted(owners[0], name), hint_for(owners[0], name, value))


def _unknown_key(key: Key, value: object, owner: type[BaseModel], root: type[BaseModel]) -> Fault:
    name = str(key[-1])
    known = [
        header((name,), {}, root) if owner is root and models_in(field.annotation) else name
        for name, field in owner.model_fields.items()
    ]
    found = f"the unknown {'table' if isinstance(value, Mapping) else 'key'} `{printable(name)}`"
    related = ((*key[:-1], "type"),) if type_name(owner) else ()
    return Fault(key, found, f"one of {', '.join(known)}", meant(name, owner, root), related)


def _union_fault(key: Key, value: object, models: list[type[BaseModel]]) -> Fault:
    """Return the fault of a table whose `type` is missing or unknown."""
    names = [type_name(model) for model in models]
    known = either(map(toml_value, names))
    chosen = value.get("type") if isinstance(value, Mapping) else value
    if isinstance(value, Mapping):
        if "type" not in value:
            strange = [name for name in value if not any(name in model.model_fields for model in models)]
            close = near("type", strange)
            if close:
                return Fault((*key, close), f"the unknown key `{close}`", f"type = {known}", "did you mean `type`?")
            alike = max(models, key=lambda model: len(set(value) & set(model.model_fields)))
            hint = f"add type = {toml_value(type_name(alike))}"
            return Fault((*key, "type"), "nothing: the key is missing", f"type = {known}", hint)
        key = (*key, "type")
    elif isinstance(value, list) and len(key) == 1:
        return _only_once(key, value)
    elif isinstance(key[-1], int):
        return Fault(key, shown(value), f"a table with type = {known}")
    elif value is None:
        needed = [field for field, info in models[0].model_fields.items() if info.is_required() and field != "type"]
        line = ", ".join([f"type = {toml_value(names[0])}", *(example(models[0], field) for field in needed)])
        hint = f"for example {key[-1]} = {{ {line} }}"
        return Fault(key, "nothing: the key is missing", f"a table with type = {known}", hint)
    close = near(chosen, names)
    hint = f"did you mean {toml_value(close)}?" if close else ""
    return Fault(key, shown(chosen), known, hint)


def _not_a_table(
    key: Key, value: object, model: type[BaseModel], data: Mapping[str, Any], root: type[BaseModel]
) -> Fault:
    name = str(key[0])
    array = is_array(name, data, root)
    if len(key) == 1 and array:
        double = f"write [[{name}]], with two brackets, above each entry"
        return Fault(key, shown(value), f"entries that start with [[{name}]]", double)
    if isinstance(value, list) and len(key) == 1:
        return _only_once(key, value)
    fields = model.model_fields
    required = [line for field, info in fields.items() if info.is_required() and (line := example(model, field))]
    lines = required or [line for field in fields if (line := example(model, field))][:1]
    if len(key) > 1 and isinstance(key[-1], str):
        inner = f"{key[-1]} = {{ {', '.join(lines)} }}"
        return Fault(key, shown(value), f"a table {key[-1]} of keys and values", f"for example {inner}")
    place = f"[[{name}]]" if array else header(key, {}, root)
    return Fault(key, shown(value), f"a table {place} of keys and values", f"write {place} and below it {lines[0]}")


def _only_once(key: Key, value: object) -> Fault:
    """Return the fault of an array of tables where the case has one table."""
    hint = f"write [{key[0]}], with single brackets, and only once"
    return Fault(key, shown(value), f"one table [{key[0]}]", hint)


def _of_the_other_form(data: Mapping[str, Any], keys: Iterable[Key], root: type[BaseModel]) -> list[Fault]:
    """Return a fault for each name that may be a table or an array of tables and has the keys of the other form."""
    faults = []
    for name, field in root.model_fields.items():
        models, entries = models_in(field.annotation), array_models(field.annotation)
        value = data.get(name)
        if not entries or len(entries) == len(models) or not any(key[0] == name for key in keys):
            continue
        given = [value] if isinstance(value, Mapping) else value if isinstance(value, list) else []
        if len(given) != 1 or not isinstance(given[0], Mapping):  # several entries are no single table
            continue
        many = isinstance(value, list)
        here = {key for model in models if (model in entries) == many for key in model.model_fields}
        there = {key for model in models if (model in entries) != many for key in model.model_fields}
        strange = [key for key in given[0] if key in there - here]
        if strange and not set(given[0]) & (here - there):
            belong = f"{', '.join(strange)} belong{'s' * (len(strange) == 1)} there"
            one = (f"one table [{name}]", f"write [{name}], with single brackets: {belong}")
            several = (f"entries that start with [[{name}]]", f"write [[{name}]], with two brackets: {belong}")
            expected, hint = one if many else several
            faults.append(Fault((name,), shown(given[0]), expected, hint))
    return faults
