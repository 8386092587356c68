"""Hints for values of a case file of a wrong type or beyond their range."""

from __future__ import annotations

import math
import re

from pydantic import BaseModel, TypeAdapter, ValidationError

from gapbeam.solver.case.reading.value_words import example, options, toml_value
from gapbeam.solver.wording.short_words import near

FACTORS = {
    "nm": 1e-9, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0,
    "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0,
    "hz": 1.0, "khz": 1e3, "pa": 1.0, "kpa": 1e3, "mpa": 1e6, "gpa": 1e9, "n": 1.0, "kn": 1e3,
    "%": 1e-2, "g": 9.81, "kg/m^3": 1.0, "kg/m3": 1.0, "g/cm^3": 1e3, "g/cm3": 1e3, "deg": 1.0, "°": 1.0,
}  # fmt: skip
"""Units that people write behind a number, in SI units, Hz or degrees."""

_NUMBER = re.compile(r"\s*([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*")


def fits(model: type[BaseModel], name: str, value: object) -> bool:
    """Return whether a key takes a value, as far as it is looked at by itself."""
    try:
        TypeAdapter(model.model_fields[name].rebuild_annotation()).validate_python(value)
    except ValidationError:
        return False
    return True


def hint_for(model: type[BaseModel], name: str, value: object) -> str:
    """Return advice for a value that was refused; the key takes every value that the advice names."""
    allowed = options(model, name)
    types = {option.get("type") for option in allowed}
    choices = [choice for option in allowed for choice in option.get("enum", [option.get("const")])]
    numeric = bool(types & {"number", "integer"})
    names = [choice for choice in choices if isinstance(choice, str)]
    match value:
        case str() if close := near(value, names):
            return f"did you mean {name} = {toml_value(close)}?"
        case str() if numeric or any(isinstance(choice, int) for choice in choices):
            return _without_quotes(model, name, value) or f"a number without quotes: {example(model, name)}"
        case str() if "array" in types:
            return f"numbers in brackets, without quotes: {example(model, name)}"
        case str() if "boolean" in types:
            return f"{name} = true or {name} = false, without quotes"
        case float() if not math.isfinite(value):
            return "a finite number"
        case float() if "integer" in types and value.is_integer() and fits(model, name, int(value)):
            return f"a whole number without decimal point: {name} = {int(value)}"
        case int() | float() if types == {"string"} and not names and not isinstance(value, bool):
            return f'quotes: {name} = "{value}"'
        case int() | float() if value < 0 and numeric and fits(model, name, -value):
            return "no minus sign"
        case list() | tuple() if len(value) == 1 and numeric and fits(model, name, value[0]):
            return f"the number without brackets: {name} = {toml_value(value[0])}"
        case list() | tuple() if "array" in types and any(isinstance(item, str) for item in value):
            return "numbers without quotes"
    line = example(model, name)
    return f"for example {line}" if line else ""


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
