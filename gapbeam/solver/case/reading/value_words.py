"""Found and expected values of a case file in words, with hints for wrong types and ranges."""

from __future__ import annotations

import datetime
import json
import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from gapbeam.solver.messages.wording import counted, either, near, printable
from gapbeam.solver.schema.table import POINT_PATTERN


def toml_value(value: object) -> str:
    """Return a number, text, switch or list as TOML writes it."""
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case list() | tuple():
            return "[" + ", ".join(map(toml_value, value)) + "]"
        case float() if float(f"{value:g}") == value and "e" in f"{value:g}":
            return f"{value:g}"
        case _:
            return str(value)


def shown(value: object) -> str:
    """Return a value as it would stand in a case file, with its kind, short enough for one line."""
    match value:
        case bool():
            return f"{toml_value(value)} (a switch)"
        case float():
            text = f"{value:.10g}"
            return text if set(text) & set(".en") else f"{text}.0"
        case int():
            return str(value) if abs(value) < 10**25 else "a number of more than 25 digits"
        case str():
            return f'"{printable(value)}" (text in quotes)'
        case list() | tuple():
            items = [_shown_inside(item) for item in value[:4]] + ["..."] * (len(value) > 4)
            return f"[{', '.join(items)}]"
        case Mapping():
            keys = [printable(key) for key in list(value)[:6]] + ["..."] * (len(value) > 6)
            return f"a table with {', '.join(keys)}" if keys else "an empty table"
        case datetime.date() | datetime.time():
            return f"{value} (a date or time)"
        case None:
            return "nothing"
        case _:
            return printable(repr(value))


def _shown_inside(item: object) -> str:
    """Return an item of a list without its own items."""
    match item:
        case Mapping():
            return "{...}"
        case list() | tuple():
            return "[...]"
        case str():
            return f'"{printable(item, 20)}"'
        case _:
            return shown(item)


def wanted(model: type[BaseModel], name: str) -> str:
    """Return the values that a key expects, in words, with its description and unit."""
    words = either(dict.fromkeys(in_words(option) for option in options(model, name)))
    description = model.model_fields[name].description
    return f"{words} ({description})" if description else words


def example(model: type[BaseModel], name: str) -> str:
    """Return a line that could stand in a case file."""
    field = model.model_fields[name]
    value = field.examples[0] if field.examples else field.default
    return f"{name} = {toml_value(value)}" if isinstance(value, bool | int | float | str | list) else ""


@cache
def options(model: type[BaseModel], name: str) -> tuple[Mapping[str, Any], ...]:
    """Return the JSON schemas of the values that a key may have: one, or several for a union."""
    schema = model.model_json_schema()
    wanted = schema["properties"][name]
    choices = [one for part in wanted.get("anyOf", [wanted]) for one in part.get("oneOf", [part])]
    definitions = schema.get("$defs", {})
    opened = (definitions[c["$ref"].rpartition("/")[2]] if "$ref" in c else c for c in choices)
    return tuple(choice for choice in opened if choice.get("type") != "null")


def in_words(schema: Mapping[str, Any]) -> str:
    """Return the values that a JSON schema allows, in words."""
    if "const" in schema or "enum" in schema:
        return either(toml_value(value) for value in schema.get("enum", [schema.get("const")]))
    match schema["type"]:
        case "number":
            return f"a number{_range(schema)}"
        case "integer":
            return f"a whole number{_range(schema)}"
        case "boolean":
            return "true or false"
        case "string" if schema.get("pattern") == POINT_PATTERN:
            return "structure.point in quotes"
        case "string" if "pattern" in schema:
            return f"a name in quotes, at most {schema['maxLength']} letters, digits, - and _, a letter first"
        case "string":
            least, most = schema.get("minLength", 0), schema.get("maxLength")
            count = f"{least} to {most}" if least > 1 and most else f"at most {most}"
            return f"text in quotes, {count} characters" if most else "text in quotes"
        case "array" if "prefixItems" in schema:
            items = schema["prefixItems"]
            if items[0].get("type") not in ("number", "integer"):
                return f"a list of {counted(len(items), 'item')}, each {in_words(items[0])}"
            limits = _range(items[0])
            return f"a list of {counted(len(items), 'number')}" + (f", each{limits}" if limits else "")
        case "array" if schema["items"].get("type") == "number":
            least, most = schema.get("minItems", 0), schema.get("maxItems")
            limits = _range(schema["items"])
            each = f", each{limits}" if limits else ""
            if most is None:
                return f"a list of numbers{each}"
            return f"a list of {f'{least} to' if least else 'at most'} {most} numbers{each}"
        case "array" if "maxItems" in schema:
            each = either(in_words(item) for item in schema["items"].get("anyOf", [schema["items"]]))
            least = f"{schema['minItems']} to" if "minItems" in schema else "at most"
            return f"a list of {least} {schema['maxItems']} items, each {each}"
        case "array":
            return "a list of tables"
        case "object" if "properties" not in schema:
            return "a table of keys and values"
        case _:
            return _table_in_words(schema)


def _table_in_words(schema: Mapping[str, Any]) -> str:
    chosen = schema["properties"].get("type", {}).get("const")
    if chosen:
        return f'a table with type = "{chosen}"'
    required = schema.get("required", [])
    return f"a table with {', '.join(required or schema['properties'])}"


def _range(schema: Mapping[str, Any]) -> str:
    """Return the range of a number in words, with a blank before it, or ""."""
    words = {
        "exclusiveMinimum": "greater than",
        "minimum": "not less than",
        "exclusiveMaximum": "less than",
        "maximum": "not more than",
    }
    if "minimum" in schema and "maximum" in schema:
        return f" from {schema['minimum']:g} to {schema['maximum']:g}"
    limits = [f"{phrase} {schema[limit]:g}" for limit, phrase in words.items() if limit in schema]
    return f" {' and '.join(limits)}" if limits else ""


FACTORS = {
    "nm": 1e-9, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0,
    "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0,
    "hz": 1.0, "khz": 1e3, "pa": 1.0, "kpa": 1e3, "mpa": 1e6, "gpa": 1e9, "n": 1.0, "kn": 1e3,
    "%": 1e-2, "g": 9.81, "kg/m^3": 1.0, "kg/m3": 1.0, "g/cm^3": 1e3, "g/cm3": 1e3, "deg": 1.0, "°": 1.0,
}  # fmt: skip
"""Units that people write behind a number, in SI units, Hz or degrees."""

JUST_BELOW = 0.998

_NUMBER = re.compile(r"\s*([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(\S*(?:\s+\S+)*)\s*")


def fits(model: type[BaseModel], name: str, value: object) -> bool:
    """Return whether a key takes a value, as far as it is looked at by itself."""
    try:
        TypeAdapter(model.model_fields[name].rebuild_annotation()).validate_python(value)
    except ValidationError:
        return False
    return True


def _holds_numbers(allowed: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether one of the options of a key is a list of numbers, or of such lists."""
    return any(re.search("'type': '(number|integer)'", str(one)) for one in allowed if one.get("type") == "array")


def hint_for(model: type[BaseModel], name: str, value: object) -> str:
    """Return advice for a value that was refused; the key takes every value that the advice names."""
    allowed = options(model, name)
    types = {option.get("type") for option in allowed}
    choices = [choice for option in allowed for choice in option.get("enum", [option.get("const")])]
    numeric = bool(types & {"number", "integer"})
    names = [choice for choice in choices if isinstance(choice, str)]
    bounds = [option.get("exclusiveMaximum") for option in allowed]
    match value:
        case str() if close := near(value, names):
            return f"did you mean {name} = {toml_value(close)}?"
        case str() if numeric or any(isinstance(choice, int) for choice in choices):
            return _without_quotes(model, name, value) or _with_example("a number without quotes", model, name)
        case str() if "array" in types:
            return _with_example("numbers in brackets, without quotes", model, name)
        case str() if "boolean" in types:
            return f"{name} = true or {name} = false, without quotes"
        case float() if not math.isfinite(value):
            return "a finite number"
        case float() if "integer" in types and value.is_integer() and fits(model, name, int(value)):
            return f"a whole number without decimal point: {name} = {int(value)}"
        case int() | float() if types == {"string"} and not names and fits(model, name, str(value)):
            return f'quotes: {name} = "{value}"'
        case int() | float() if value < 0 and numeric and fits(model, name, -value):
            return "no minus sign"
        case int() | float() if value in bounds and fits(model, name, JUST_BELOW * value):
            return f"just below: {name} = {JUST_BELOW * value:g}"
        case list() | tuple() if len(value) == 1 and numeric and fits(model, name, value[0]):
            return f"the number without brackets: {name} = {toml_value(value[0])}"
        case list() | tuple() if any(isinstance(item, str) for item in value) and _holds_numbers(allowed):
            return "numbers without quotes"
    line = example(model, name)
    return f"for example {line}" if line else ""


def _with_example(advice: str, model: type[BaseModel], name: str) -> str:
    """Return advice, with a line that follows it where the key has an example."""
    line = example(model, name)
    return f"{advice}: {line}" if line else advice


def _without_quotes(model: type[BaseModel], name: str, text: str) -> str:
    """Return a hint where a text is a number in disguise: in quotes, with a decimal comma, with a unit."""
    match = _NUMBER.fullmatch(text[:60])
    if not match:
        return ""
    number, unit = float(match[1].replace(",", ".")), match[2].lower()
    point = " and write a decimal point" if "," in match[1] else ""
    meant = number * FACTORS.get(unit, 1.0)
    meant = float(f"{meant:.12g}")
    if not fits(model, name, meant):
        return ""
    if not unit:
        return f"remove the quotes{point}: {name} = {toml_value(number)}"
    if unit not in FACTORS:
        return "write the number alone, without quotes and unit, in SI units"
    return f"remove the quotes and the unit{point}: {name} = {meant!r}"


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
