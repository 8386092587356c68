"""The JSON schema by which editors complete and check a case file as one types."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, BeforeValidator

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.known_keys import tables
from gapbeam.solver.table import models_in, named, type_name


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a case file."""
    document = _without_null(Case.model_json_schema())
    models: list[type[BaseModel]] = [Case, *(one.model for one in tables())]
    for table in models:
        properties = (document if table is Case else document["$defs"][table.__name__])["properties"]
        for key, field in table.model_fields.items():
            if BeforeValidator(named) in field.metadata:  # takes a name or a table
                by_type = {part: properties[key].pop(part) for part in ("oneOf", "discriminator")}
                properties[key]["anyOf"] = [{"enum": [type_name(one) for one in models_in(field.annotation)]}, by_type]
    return {
        **document,
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "gapbeam case file",
        "description": "A beam in a support with play. SI units throughout, frequencies in Hz.",
    }


def _without_null(part: Any) -> Any:
    """Leave out null, which TOML does not have: a key without a value is left out."""
    if isinstance(part, list):
        return [_without_null(item) for item in part if item != {"type": "null"}]
    if not isinstance(part, dict):
        return part
    kept = {key: _without_null(value) for key, value in part.items() if value is not None}
    options = kept.get("anyOf", [])
    return {**options[0], **{k: v for k, v in kept.items() if k != "anyOf"}} if len(options) == 1 else kept
