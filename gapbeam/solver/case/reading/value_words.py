"""Values of a case file and what is wanted of them, in words."""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from pydantic import BaseModel

from gapbeam.solver.table import POINT_PATTERN
from gapbeam.solver.wording.short_words import either, printable


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
    """Return an item of a list, with what it holds itself left out."""
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
                return f"a list of {len(items)} items, each {in_words(items[0])}"
            limits = _range(items[0])
            return f"a list of {len(items)} numbers" + (f", each{limits}" if limits else "")
        case "array" if schema["items"].get("type") == "number":
            least, most = schema.get("minItems", 0), schema["maxItems"]
            limits = _range(schema["items"])
            each = f", each{limits}" if limits else ""
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
