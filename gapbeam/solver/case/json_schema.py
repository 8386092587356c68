"""The JSON schema by which editors complete and check a case file as one types.

A table of several types is checked by the keywords if and then, by its `type` alone: a validator then names the key
that is wrong. By oneOf it could only say that none of the types fits. Editors that complete by `properties` find the
keys of all types there.

Descriptions of keys end with the unit, ", m/s^2", where a remark may follow behind ";".
"""

from __future__ import annotations

import re
from typing import Any

from pydantic import BaseModel, BeforeValidator

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.known_keys import tables
from gapbeam.solver.schema.table import models_in, named, type_name

KEPT = ("title", "description", "default")


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a case file."""
    document = _without_null(Case.model_json_schema())
    models: list[type[BaseModel]] = [Case, *(one.model for one in tables())]
    definitions = document["$defs"]
    names = {
        (table.__name__, key): [type_name(one) for one in models_in(field.annotation)]
        for table in models
        for key, field in table.model_fields.items()
        if BeforeValidator(named) in field.metadata  # takes a name or a table
    }
    for table in models:
        properties = (document if table is Case else definitions[table.__name__])["properties"]
        for key in table.model_fields:
            properties[key] = _by_type(properties[key], definitions)
            if table is Case:
                _let_type_out(properties[key])
            if (table.__name__, key) in names:
                said = {one: properties[key].pop(one) for one in KEPT if one in properties[key]}
                by_name = {"enum": names[table.__name__, key]}
                properties[key] = {**said, "if": {"type": "string"}, "then": by_name, "else": properties[key]}
    support = document["properties"]["support"]  # of two forms, one table or an array of tables
    table, array = support.pop("oneOf")
    support |= {"type": ["object", "array"], "if": {"type": "array"}, "then": array, "else": table}
    return {
        **document,
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "gapbeam case file",
        "description": "A beam in a support with play. SI units throughout, frequencies in Hz.",
    }


def _by_type(part: Any, definitions: dict[str, Any]) -> Any:
    """Replace oneOf with a discriminator by a condition for each type."""
    if isinstance(part, list):
        return [_by_type(item, definitions) for item in part]
    if not isinstance(part, dict):
        return part
    found = {key: _by_type(value, definitions) for key, value in part.items()}
    if "discriminator" not in found:
        return found
    types = {name: place.rpartition("/")[2] for name, place in found.pop("discriminator")["mapping"].items()}
    found.pop("oneOf")
    keys = dict[str, Any]()
    for table in types.values():
        for key, described in definitions[table]["properties"].items():
            keys.setdefault(key, {"description": described["description"]} if "description" in described else {})
    keys["type"] = {"enum": list(types), "description": keys["type"]["description"]}
    conditions = [
        {"if": {"properties": {"type": {"const": name}}, "required": ["type"]}, "then": {"$ref": f"#/$defs/{table}"}}
        for name, table in types.items()
    ]
    return {**found, "type": "object", "required": ["type"], "properties": keys, "allOf": conditions}


def _let_type_out(part: dict[str, Any]) -> None:
    """Check a table of a case without a type as one of its default type."""
    kind = part.get("default", {}).get("type") if "allOf" in part else None
    for condition in part.get("allOf", []):
        if condition["if"]["properties"]["type"]["const"] == kind:
            del part["required"], condition["if"]["required"]


def _without_null(part: Any) -> Any:
    """Leave out null, which TOML does not have: a key without a value is left out."""
    if isinstance(part, list):
        return [_without_null(item) for item in part if item != {"type": "null"}]
    if not isinstance(part, dict):
        return part
    kept = {key: _without_null(value) for key, value in part.items() if value is not None}
    options = kept.get("anyOf", [])
    return {**options[0], **{k: v for k, v in kept.items() if k != "anyOf"}} if len(options) == 1 else kept


OF_KEY, OF_QUANTITY = "in the unit of the key", "in the unit of the quantity"
UNITS = (
    "m", "s", "N", "GB", "Hz", "Pa", "Pa/m", "Pa s/m", "N/m", "N s/m", "1/s", "m/s", "kg", "kg/m", "N s/m^2", "kg m^2",
    "N m/rad", "N m s/rad", "kg/m^3", "m/s^2", "m/s^2, m/s or m", "N or m/s^2", "N^2/Hz or (m/s^2)^2/Hz", "no unit",
    "degrees", "rad", "rad/s", "m^2", "1/Pa", OF_KEY, OF_QUANTITY,
)  # fmt: skip
"""Units that descriptions end with."""

_ENDING = re.compile(
    f"(?:^|, )({'|'.join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))})(?= \\(|;|$)"
)


def unit_in(description: str) -> str:
    """Return the unit that a description of a key ends with; "" where it has none."""
    found = _ENDING.search(description)
    return found[1] if found else ""
