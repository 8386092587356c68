"""Hints for unknown keys: one that names a key of another table names a table that takes the value."""

from __future__ import annotations

import re
import tomllib
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.case_reader import read_case_tables
from gapbeam.solver.case.reading.known_keys import meant, tables
from gapbeam.solver.messages.errors import CaseError, Fault
from gapbeam.solver.messages.wording import same
from gapbeam.solver.scene_file.scene_case import SceneCase
from tests.shared.case_texts import GOOD

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


HINTS = [
    ("support", {"type": "hole"}, 'did you mean region = "hole"?'),
    ("support", {"shape": "stop"}, 'did you mean region = "stop"?'),
    ("support", {"sides": "below"}, ""),
    ("support", {"length": 0.05}, "it ends at `to`: `from` plus the length"),
    ("segment", {"length": 0.05}, "it ends at `to`: `from` plus the length"),
    ("fluid", {"length": 0.05}, "it ends at `to`: `from` plus the length"),
    ("support", {"mass": 1.0}, "`mass` belongs in [support.body]"),
    ("support", {"direction": [0.0, 1.0]}, "`direction` belongs in [[load]]"),
    ("support", {"spring": 1e6}, "did you mean `stiffness`?"),
    ("support", {"initial_gap": 1e-4}, "did you mean `clearance`?"),
    ("contact", {"type": "penalty"}, 'did you mean formulation = "penalty"?'),
    ("contact", {"method": "nitsche"}, 'did you mean formulation = "nitsche"?'),
    ("contact", {"model": "kelvin-voigt"}, 'did you mean law = "kelvin-voigt"?'),
    ("model", {"kind": "beam"}, 'did you mean type = "beam"?'),
    ("damping", {"zeta": 0.01}, "did you mean `ratio`?"),
    ("damping", {"zeta": [0.01, 0.02]}, "did you mean `ratios`?"),
    ("damping", {"alpha": 1.0}, "`mass` is the coefficient of M"),
    ("damping", {"loss_factor": 0.01}, ""),
    ("time", {"tmax": 1.0}, "did you mean `end`?"),
    ("time", {"stop": 1.0}, "did you mean `end`?"),
    ("time", {"steps": 100}, "their number is `end` over `step`"),
    ("joint", {"end": "left"}, ""),
    ("probe", {"direction": "z"}, ""),
    ("load", {"path": "x.csv"}, 'did you mean `file`, which belongs in [[load]] of type "recorded_force"'),
    ("material", {"name": "steel"}, ""),
    ("beam", {"E": 2.1e11}, "did you mean `young_modulus`, which belongs in [material] or [[segment]]?"),
]


@pytest.mark.parametrize(("name", "entry", "words"), HINTS, ids=lambda one: str(one)[:30])
def test_words_of_other_programs(name: str, entry: dict[str, Any], words: str) -> None:
    """No hint is better than one at a key that does not take the value, or at fifteen tables."""
    ((key, value),) = entry.items()
    model = next(one.model for one in reversed(tables(Case)) if one.header.strip("[]") == name)
    found = meant(key, model, Case, value)
    assert found.startswith(words) if words else found == ""


def test_tables_below_the_header_of_another_are_one_fault_each() -> None:
    """A header in a file of lines takes all lines below it: no table is missing, and each is said to be one."""
    case = tomllib.loads(GOOD)
    for host in ("beam", "mesh", "output", "damping"):
        for moved in {"material", "support", "time", "load", "probe", "model"} - {host}:
            table = case.get(moved, [{"type": "gravity"}] if moved == "load" else {"type": "beam"})
            nested = {name: value for name, value in case.items() if name != moved}
            nested |= {host: {**case.get(host, {}), moved: table}}
            (fault,) = read_faults(nested)
            assert fault.key == (host, moved)
            place = f"[[{moved}]]" if moved in ("load", "probe") else f"[{moved}]"
            assert fault.hint.startswith(f"{place} is a table of its own"), fault


def read_faults(tables: dict[str, Any]) -> list[Fault]:
    """Return the faults of a case."""
    with pytest.raises(CaseError) as caught:
        read_case_tables(tables)
    return list(caught.value.faults)


def test_another_form_of_a_table_has_the_choice() -> None:
    """A single [support] is a slot by its length; holes are for [[support]]."""
    single = next(one.model for one in tables(Case) if one.header == "[support]")
    assert meant("type", single, Case, "hole") == 'did you mean region = "hole", which belongs in [[support]]?'


def test_a_named_choice_is_one_that_its_key_takes() -> None:
    """Every type of every table within another is found by its name, whatever the key was called."""
    for table in tables(Case):
        for inner in tables(Case):
            outer, _, key = inner.header.strip("[]").rpartition(".")
            if outer == table.header.strip("[]") and inner.kind and key in table.model.model_fields:
                found = meant("sort_of_it", table.model, Case, inner.kind)
                line = re.fullmatch(r"did you mean (\w+ = .+)\?", found)
                assert line is not None
                if "..." in line[1]:  # a key without an example
                    continue
                ((chosen, value),) = tomllib.loads(line[1]).items()
                assert chosen == "type" or taken(chosen, value, Case), found
