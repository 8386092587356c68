"""Hints for unknown keys: one that names a key of another table names a table that takes the value."""

from __future__ import annotations

import re
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.known_keys import meant, tables
from gapbeam.solver.messages.wording import same
from gapbeam.solver.scene_file.scene_case import SceneCase

FAR = re.compile(r"did you mean `(?P<word>\w+)`, which belongs in (?P<places>.+)\?")


def taken(word: str, value: Any, root: Any) -> bool:
    for table in tables(root):
        if word in table.model.model_fields:
            try:
                TypeAdapter(table.model.model_fields[word].rebuild_annotation()).validate_python(value)
            except ValidationError:
                continue
            return True
    return False


@pytest.mark.parametrize("root", [Case, SceneCase])
@pytest.mark.parametrize("value", [3.0, "maximum", [1.0, 2.0, 3.0], True])
def test_a_near_key_of_another_table_takes_the_value(root: Any, value: Any) -> None:
    """Of every other key without its last letter, or with one more."""
    keys = sorted({key for table in tables(root) for key in table.model.model_fields})
    hints = 0
    for table in tables(root)[:1]:
        for typed in (form for key in keys[::2] for form in (key[:-1], f"{key}s") if not same(form, keys)):
            if found := FAR.fullmatch(meant(typed, table.model, root, value)):
                hints += 1
                assert taken(found["word"], value, root), (table.header, typed, found[0])
    assert hints > 2


@pytest.mark.parametrize("root", [Case, SceneCase])
@pytest.mark.parametrize("value", [3.0, "maximum"])
def test_a_value_of_a_load_or_a_figure_is_named_as_they_name_it(root: Any, value: Any) -> None:
    """A `value` was taken for the `values` of a table of coherences."""
    loads = [table.model for table in tables(root) if table.header == "[[load]]"]
    assert len(loads) > 8
    assert all("`amplitude`" in meant("value", one, root, value) for one in loads)
    assert "`statistic`" in meant("value", Figure, root, value)
