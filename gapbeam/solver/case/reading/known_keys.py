"""The tables and keys that a case file may hold, read off its models, and faults of single keys with suggestions.

The root is the model of the whole file, by default `gapbeam.solver.case.case.Case`.

Numbers have limits beyond which their squares and products would overflow or vanish.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.value_words import example, fits, hint_for, shown, toml_value, wanted
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import close_to, either, near, printable, same
from gapbeam.solver.schema.table import FORMS, Positive, array_models, models_in, type_name


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
        name: Name of the table.
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


def label(key: Key, data: object, root: type[BaseModel] = Case) -> str:
    """Return a key as a person names it: [support] clearance, [[load]] number 2 (name "shaker") amplitude."""
    if not key:
        return "the whole case"
    value = value_at(key, data)
    is_table = isinstance(value, Mapping) or (value is None and bool(candidates(key, data, root)))
    if is_table or isinstance(key[-1], int):
        return header(key, data, root)
    if len(key) == 1 and isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
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


def meant(name: str, model: type[BaseModel], root: type[BaseModel] = Case, value: object = None) -> str:
    """Return a hint for an unknown key: a near miss in its table, or the table where it belongs; "" if none.

    Args:
        name: The key as written.
        model: The table it was found in.
        root: Model of the whole file.
        value: Value of the key; where several keys are near, one that takes it was meant.
    """
    own = list(model.model_fields)
    hints = getattr(model, "elsewhere", {})
    if hint := hints.get(same(name, list(hints)) or ""):
        return str(hint)
    if model is not root and name in root.model_fields and name not in own and isinstance(value, Mapping | list):
        place = header((name,), {}, root)
        return f"{place} is a table of its own: its line goes above the first [table], or its keys below {place}"
    takes = [key for key in own if fits(model, key, value)]
    if word := same(name, takes) or same(name, own):
        return _own_key(word, model, root)
    if chosen := _named_choice(value, model, root):
        return f"did you mean {chosen}?"
    every = sorted({key for table in tables(root) for key in table.model.model_fields})
    far = same(name, [key for key in every if key not in OF_MANY])
    if not far and (word := close_to(name, takes) or close_to(name, own, FAR)):
        return _own_key(word, model, root)
    word = far or close_to(name, every, FAR)
    homes = [table for table in tables(root) if word in table.model.model_fields]
    homes = [table for table in homes if value is None or fits(table.model, str(word), value)]
    here = {table.header for table in tables(root) if table.model is model}
    homes = [table for table in homes if table.header in here] or homes  # another type of the same table is nearest
    names = {table.strip("[]") for table in here}
    homes = [table for table in homes if table.header.strip("[]") in names] or homes  # or another form of it
    within = tuple(f"[{table}." for table in names)
    homes = [table for table in homes if within and table.header.startswith(within)] or homes  # or a table inside it
    types = {
        home.header: [f'"{one.kind}"' for one in homes if one.header == home.header and one.kind] for home in homes
    }
    if not 0 < len(types) <= MOST_HOMES:
        return ""
    places = [
        f"{table} of type {either(dict.fromkeys(kinds))}" if 0 < len(kinds) <= MOST_KINDS else table
        for table, kinds in types.items()
    ]
    if word == name:
        return f"`{name}` belongs in {either(places)}"
    return f"did you mean `{word}`, which belongs in {either(places)}?"


OF_MANY = ("type", "name", "from", "to", "point")
"""Keys of many tables: no hint at those of others."""
MOST_HOMES, MOST_KINDS = 4, 7
"""Tables that have a key, and types of one, beyond which a hint at them would be a list."""
FAR = 0.81
"""Least likeness of the spelling of a key of another table."""


def _own_key(word: str, model: type[BaseModel], root: type[BaseModel]) -> str:
    is_table = model is root and models_in(model.model_fields[word].annotation)
    return f"did you mean {header((word,), {}, root) if is_table else f'`{word}`'}?"


def _named_choice(value: object, model: type[BaseModel], root: type[BaseModel]) -> str:
    """Return the line with the key whose table has a type of this name, region = "hole"; "" if none.

    The key is one of the table, or of another form of it: [[support]] for [support].
    """
    if not isinstance(value, str):
        return ""
    here = {table.header for table in tables(root) if table.model is model}
    if value in {table.kind for table in tables(root) if table.header in here and table.kind}:
        return f"type = {toml_value(value)}"
    names = {header.strip("[]") for header in here}
    forms = (table for table in tables(root) if table.header.strip("[]") in names and table.header not in here)
    others = (f"{line}, which belongs in {one.header}" for one in forms if (line := _choice_in(one.model, value)))
    return _choice_in(model, value) or next(others, "")


def _choice_in(model: type[BaseModel], value: str) -> str:
    """Return the line of a table in which a key has a table of this type; "" if none."""
    for key, field in model.model_fields.items():
        for inner in models_in(field.annotation):
            if type_name(inner) == value:
                asked = [name for name, part in inner.model_fields.items() if part.is_required() and name != "type"]
                rest = "".join(f", {example(inner, name) or f'{name} = ...'}" for name in asked)
                word = toml_value(value)
                return f"{key} = {word}" if fits(model, key, value) else f"{key} = {{ type = {word}{rest} }}"
    return ""


MOST_FAULTS = 100


@cache
def _adapters(root: type[BaseModel]) -> dict[str, TypeAdapter[Any]]:
    return {name: TypeAdapter(field.rebuild_annotation()) for name, field in root.model_fields.items()}


def check_types(data: Mapping[str, Any], root: type[BaseModel] = Case) -> tuple[dict[str, Any], list[Fault]]:
    """Check every key by itself; a table with a number that is beyond all reason is not intact.

    Args:
        data: The file as read.
        root: Model of the whole file.

    Returns:
        The tables that are intact, arrays of tables as {number: entry}; and the faults.
    """
    beyond = beyond_reason(data, root)
    try:
        tables = dict(root.model_validate(data))
        if not beyond:
            return numbered(tables), []
        keys = dict[Key, None]()
    except ValidationError as error:
        keys = dict.fromkeys(_key(location, data, root) for location in _innermost(error))
    beyond = [fault for fault in beyond if fault.key not in keys]
    words = _without_echoes(list(keys)[:MOST_FAULTS], data, root)
    others = _of_the_other_form(data, keys, root)
    known = {fault.key for fault in others}
    faulty = [*keys, *(fault.key for fault in beyond)]
    intact = {name: table for name, table in _intact(data, faulty, root).items() if (name,) not in known}
    return intact, [*others, *(_fault(key, data, root) for key in words if key[:1] not in known), *beyond]


def incomplete(faults: Iterable[Fault], data: Mapping[str, Any], root: type[BaseModel] = Case) -> frozenset[str]:
    """Return the arrays of tables of which an entry has a fault of its own."""
    return frozenset(str(one.key[0]) for one in faults if len(one.key) > 1 and is_array(one.key[0], data, root))


def _innermost(error: ValidationError) -> list[tuple[int | str, ...]]:
    """Return the locations of faults, without those of a table or list around another fault.

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
        if isinstance(value_at((*table, name), data), Mapping | list):
            meant_here.add((name,))  # a table of its own, below the header of another one
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
        lines = [example(models[0], field) or field for field in keys]
        hint = f"add {header(key, data, root)} with {', '.join(lines)}"
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
    return Fault(key, found, f"one of {', '.join(known)}", meant(name, owner, root, value), related)


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
        line = ", ".join(
            [f"type = {toml_value(names[0])}", *filter(None, (example(models[0], field) for field in needed))]
        )
        hint = f"for example {key[-1]} = {{ {line} }}"
        return Fault(key, "nothing: the key is missing", f"a table with type = {known}", hint)
    close = _meant_type(chosen, value if isinstance(value, Mapping) else {}, models)
    hint = f"did you mean {toml_value(close)}?" if close else ""
    return Fault(key, shown(chosen), known, hint)


def _meant_type(chosen: object, table: Mapping[str, Any], models: list[type[BaseModel]]) -> str | None:
    """Return the type that was probably meant: of those that have the word the one that takes the keys of the table."""
    names, given = list(map(type_name, models)), set(table) - {"type"}

    def strange(model: type[BaseModel]) -> tuple[int, int]:
        fields = model.model_fields
        needed = {name for name, info in fields.items() if info.is_required()} - {"type"}
        return len(given - set(fields)), len(needed - given)

    parts = [one for one in models if str(chosen).lower() in type_name(one).split("_")]
    if parts and not same(chosen, names):
        return type_name(min(parts, key=strange))
    return near(chosen, names)


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
        strange = [meant for key in given[0] if key not in here and (meant := same(key, list(there - here)))]
        if strange and not set(given[0]) & (here - there):
            other, had = next(one for one in models if (one in entries) != many), {*given[0], *strange}
            asked = [key for key, info in other.model_fields.items() if info.is_required() and key not in had]
            adds = "".join(f", add {example(other, key)}" for key in asked)
            place, words = (f"one table [{name}]", "single") if many else (f"entries that start with [[{name}]]", "two")
            hint = f"write {place.split()[-1]}, with {words} brackets: {', '.join(strange)} belong"
            faults.append(Fault((name,), shown(given[0]), place, f"{hint}{'s' * (len(strange) == 1)} there{adds}"))
    return faults


LARGEST = 1.0e30
SMALLEST = 1.0e-30
"""Least value of positive numbers that others are divided by."""


def beyond_reason(data: Mapping[str, Any], root: type[BaseModel] = Case) -> list[Fault]:
    """Return a fault for every key whose number, or one of whose list, is beyond all reason in SI units.

    Args:
        data: The file as read.
        root: Model of the whole file.
    """
    hint, faults = "all values are in SI units, Hz and degrees", list[Fault]()
    for key, value in _numbers((), data):
        if abs(value) > LARGEST:
            faults.append(Fault(key, shown(value), f"at most {LARGEST:g} in size", hint))
        elif 0.0 < value < SMALLEST and _is_positive(key, data, root):
            faults.append(Fault(key, shown(value), f"at least {SMALLEST:g}", hint))
    return faults


def _numbers(key: Key, value: Any) -> Iterator[tuple[Key, float]]:
    """Yield the numbers in a value, each with the key that it stands behind."""
    if isinstance(value, Mapping):
        for name, entry in value.items():
            yield from _numbers((*key, name), entry)
    elif isinstance(value, list | tuple):
        for number, entry in enumerate(value):
            yield from _numbers((*key, number) if isinstance(entry, Mapping) else key, entry)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield key, value


def _is_positive(key: Key, data: Mapping[str, Any], root: type[BaseModel]) -> bool:
    """Return whether a key holds a number above 0, or none."""
    fields = [model.model_fields.get(str(key[-1])) for model in candidates(key[:-1], data, root)]
    return any(
        Positive in get_args(field.annotation) or any(getattr(entry, "gt", None) == 0 for entry in field.metadata)
        for field in fields
        if field is not None
    )
