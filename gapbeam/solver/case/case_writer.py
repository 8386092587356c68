"""A case as a complete case file, with every default and what each key means."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence

from pydantic import BaseModel

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.value_words import toml_value


def case_to_toml(case: Case, heading: Sequence[str] = ()) -> str:
    """Return a case as a case file with every default, which reads back to an equal case.

    Args:
        case: The case.
        heading: Lines for the comment that opens the file, such as versions.
    """
    lines = [f"# {line}".rstrip() for line in "\n".join(heading).splitlines()]
    lines.append(f"title = {toml_value(case.title)}")
    for name, value in case:
        if isinstance(value, BaseModel):
            lines += ["", f"[{name}]  {_purpose(value)}", *_keys(value)]
        elif isinstance(value, tuple):
            for entry in value:
                lines += ["", f"[[{name}]]  {_purpose(entry)}", *_keys(entry)]
    return "\n".join(lines) + "\n"


def _purpose(table: BaseModel) -> str:
    return "# " + (inspect.getdoc(type(table)) or "").split("\n")[0]


def _keys(table: BaseModel) -> Iterator[str]:
    """Yield a line for every key, with its meaning behind it; keys without a value stand in comments."""
    keys = sorted(type(table).model_fields, key=lambda key: {"type": 0, "name": 1}.get(key, 2))
    given = {key: f"{key} = {_written(getattr(table, key))}" for key in keys if getattr(table, key) is not None}
    widest = max(map(len, given.values()), default=0)
    for key in keys:
        line = f"{given[key]:{widest}}  # " if key in given else f"# {key}: not given; "
        yield line + (type(table).model_fields[key].description or "")


def _written(value: object) -> str:
    """Return a value as TOML writes it, an inner table in one line."""
    if isinstance(value, BaseModel):
        given = (f"{key} = {toml_value(inner)}" for key, inner in value if inner is not None)
        return "{ " + ", ".join(given) + " }"
    return toml_value(value)
