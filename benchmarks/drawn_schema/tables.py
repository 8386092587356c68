"""Tables drawn key by key, with every choice that the schema of cases offers: named values from it, others by rules."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from benchmarks.drawn_schema.rules import LeftOut, Scene, rule_of
from gapbeam.solver.case.case import Case
from gapbeam.solver.integrators.time_scheme import SOFT_CONTACT
from gapbeam.solver.schema.table import models_in, type_name


@dataclass(frozen=True)
class Choice:
    """One of the values that a key may have.

    Attributes:
        table: Class of the table that the key belongs to.
        key: Key in that table.
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


NOT_DRAWN = ("type", "units", "figure")  # a case that was read is in SI; figures of one's own name records of its run


def _choices(table: type[BaseModel]) -> Iterator[Choice]:
    for key, field in table.model_fields.items():
        if key in NOT_DRAWN:
            continue
        inner = models_in(field.annotation)
        if inner:
            types = {type_name(model) or model.__name__: model for model in inner}
            for name, model in types.items():
                if len(types) > 1 or not field.is_required():
                    yield Choice(table.__name__, key, name)
                yield from _choices(model)
        else:
            yield from (Choice(table.__name__, key, value) for value in named_values(field.annotation))


GIVEN = 0.4  # share of the keys with a default that are given, where no rule decides it


class NoRuleError(LookupError):
    """A key of the schema that nobody has said how to draw."""


@dataclass(frozen=True)
class Draw:
    """Generator of tables from the schema of case files.

    Attributes:
        chance: Random number generator.
        scene: Scales that the numbers are relative to.
        focus: A choice that is taken wherever its key is drawn.
    """

    chance: random.Random
    scene: Scene
    focus: Choice

    def table(self, model: type[BaseModel]) -> dict[str, Any]:
        """Draw a table.

        Raises:
            NoRuleError: One of its keys has neither a rule nor named values.
        """
        drawn: dict[str, Any] = {}
        for key, field in model.model_fields.items():
            if key == "type":
                drawn["type"] = type_name(model)
            elif not isinstance(value := self.value(model, key, field), LeftOut):
                drawn[key] = value
        return drawn

    def value(self, model: type[BaseModel], key: str, field: FieldInfo) -> Any:
        """Draw the value of a key, or that it is left out."""
        if key in NOT_DRAWN:
            return LeftOut()
        focused = self.focus.key == key and self.focus.table in {base.__name__ for base in model.__mro__}
        named, inner, rule = named_values(field.annotation), models_in(field.annotation), rule_of(model, key)
        if focused and self.focus.value in named:
            return self.focus.value
        if inner:
            return self._inner(inner, field, focused)
        if rule is not None:
            return rule(self.chance, self.scene)
        if not named:
            raise NoRuleError(f"{model.__name__}.{key}: say in benchmarks/drawn_schema/rules.py how it is drawn")
        optional = not field.is_required()
        return LeftOut() if optional and self.chance.random() > GIVEN else self.chance.choice(named)

    def _inner(self, inner: list[type[BaseModel]], field: FieldInfo, focused: bool) -> Any:
        wanted = [model for model in inner if self._leads_to_focus(model, focused)]
        if len(inner) == 1 and not field.is_required() and not wanted and self.chance.random() > GIVEN:
            return LeftOut()
        weights = [1.0 if getattr(model, "contact_range", None) == SOFT_CONTACT else 4.0 for model in wanted or inner]
        return self.table(self.chance.choices(wanted or inner, weights)[0])

    def _leads_to_focus(self, model: type[BaseModel], focused: bool) -> bool:
        """Return whether a table is the one in focus, or holds the key that is."""
        if focused:
            return self.focus.value in (type_name(model), model.__name__)
        below = [part for field in model.model_fields.values() for part in models_in(field.annotation)]
        names = {base.__name__ for base in model.__mro__}
        in_it = self.focus.table in names and self.focus.key in model.model_fields
        return in_it or any(self._leads_to_focus(part, False) for part in below)
