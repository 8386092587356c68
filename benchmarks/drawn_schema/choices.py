"""Every choice that the schema of cases offers: tables of unions, named values, switches; found, not listed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel

from gapbeam.solver.case.case import Case
from gapbeam.solver.table import models_in, type_name


@dataclass(frozen=True)
class Choice:
    """One of the values that a key may have.

    Attributes:
        table: Class of the table that the key belongs to.
        key: Of that table.
        value: A named value or a switch; the type of a table that the key holds.
    """

    table: str
    key: str
    value: Any

    def __str__(self) -> str:
        return f"{self.table}.{self.key} = {self.value}"


def named_values(annotation: Any) -> list[Any]:
    """Return the values that an annotation names: those of its literals, and of a switch; not of arrays."""
    if get_origin(annotation) is Literal:
        return list(get_args(annotation))
    if annotation is bool:
        return [True, False]
    if models_in(annotation) or get_origin(annotation) is tuple:
        return []
    return [value for part in get_args(annotation) for value in named_values(part)]


def all_choices() -> list[Choice]:
    """Return all choices of the schema, in its order."""
    return list(dict.fromkeys(_choices(Case)))


def _choices(table: type[BaseModel]) -> Iterator[Choice]:
    for key, field in table.model_fields.items():
        inner = models_in(field.annotation)
        if inner:
            types = {type_name(model) or model.__name__: model for model in inner}
            for name, model in types.items():
                if len(types) > 1 or not field.is_required():
                    yield Choice(table.__name__, key, name)
                yield from _choices(model)
        elif key not in ("type", "units"):  # a case that was read is in SI
            yield from (Choice(table.__name__, key, value) for value in named_values(field.annotation))
