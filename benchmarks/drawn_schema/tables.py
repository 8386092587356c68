"""Tables drawn key by key: named values as the schema names them, all others by their rules."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from benchmarks.drawn_schema.choices import Choice, named_values
from benchmarks.drawn_schema.rules import LeftOut, rule_of, weight_of
from benchmarks.drawn_schema.scene import Scene
from gapbeam.solver.table import models_in, type_name

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
        weights = [weight_of(model) for model in wanted or inner]
        return self.table(self.chance.choices(wanted or inner, weights)[0])

    def _leads_to_focus(self, model: type[BaseModel], focused: bool) -> bool:
        """Return whether a table is the one in focus, or holds the key that is."""
        if focused:
            return self.focus.value in (type_name(model), model.__name__)
        below = [part for field in model.model_fields.values() for part in models_in(field.annotation)]
        names = {base.__name__ for base in model.__mro__}
        in_it = self.focus.table in names and self.focus.key in model.model_fields
        return in_it or any(self._leads_to_focus(part, False) for part in below)
