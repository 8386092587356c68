"""The JSON schema by which editors complete and check a case file as one types."""

from __future__ import annotations

from typing import Any

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.table import models_in, type_name

NAMED = ((Time, "scheme"), (Contact, "formulation"), (Contact, "law"))
"""Keys that take a name or a table."""


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a case file."""
    document = _without_null(Case.model_json_schema())
    for table, key in NAMED:
        entry = document["$defs"][table.__name__]["properties"][key]
        tables = {part: entry.pop(part) for part in ("oneOf", "discriminator")}
        names = [type_name(model) for model in models_in(table.model_fields[key].annotation)]
        entry["anyOf"] = [{"enum": names}, tables]
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
