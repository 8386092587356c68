"""Cases drawn from the whole schema: valid, the same for the same seed, and none of its choices left out."""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

import gapbeam
from benchmarks.drawn_schema.attempts import drawn
from benchmarks.drawn_schema.rules import drawn_scene
from benchmarks.drawn_schema.tables import Choice, Draw, NoRuleError, all_choices
from gapbeam.solver.schema.table import Positive, Table, type_name

CHOICES = all_choices()


class Unknown(Table):
    """A table with a key that nobody has said how to draw."""

    stiffness: Positive


def tables_in(value: Any) -> Iterator[BaseModel]:
    """Yield a table and those within it."""
    if isinstance(value, BaseModel):
        yield value
        for key in type(value).model_fields:
            yield from tables_in(getattr(value, key))
    elif isinstance(value, tuple):
        for part in value:
            yield from tables_in(part)


def takes(case: BaseModel, choice: Choice) -> bool:
    """Return whether a case has made a choice."""
    for table in tables_in(case):
        if choice.table not in [one.__name__ for one in type(table).__mro__]:
            continue
        held = getattr(table, choice.key)
        for one in held if isinstance(held, tuple) else (held,):
            same = choice.value in (type_name(type(one)), type(one).__name__) if isinstance(one, BaseModel) else False
            if same or one == choice.value:
                return True
    return False


@pytest.mark.slow(minutes=0.3)
def test_every_choice_of_the_schema_is_drawn_in_valid_cases(tmp_path: Path) -> None:
    """One case for each of the hundred choices: the reader has nothing against it, and it has made its choice."""
    assert len(CHOICES) > 100
    for seed in range(len(CHOICES)):
        tables, focus = drawn(seed, tmp_path)
        case = gapbeam.read_case(tables)
        chosen = "auto" in (focus.value, tables.get("model", {}).get("type")) and case.model.reasons  # what auto is for
        assert chosen or takes(case, focus), (seed, str(focus))


def test_choices_are_those_of_the_schema() -> None:
    """Models, schemes, laws, formulations, loads and analyses are found in the unions of the schema."""
    known = {(choice.table, choice.key, choice.value) for choice in CHOICES}
    for one in (
        ("Case", "model", "rigid"),
        ("Time", "scheme", "moreau-jean"),
        ("Contact", "law", "adams-impact"),
        ("Contact", "formulation", "nitsche"),
        ("NitscheMethod", "theta", -1),
        ("Case", "load", "recorded_motion"),
        ("Periodic", "method", "harmonic-balance"),
        ("Case", "analysis", "transient"),
    ):
        assert one in known


def test_a_seed_gives_one_case(tmp_path: Path) -> None:
    """Tables and records are the same again, and others for other seeds."""
    (tmp_path / "again").mkdir()
    names = set()
    recorded = next(number for number, choice in enumerate(CHOICES) if choice.value == "recorded_motion")
    for seed in (0, 50, 52, recorded):
        first, again = drawn(seed, tmp_path)[0], drawn(seed, tmp_path / "again")[0]
        names.add(str(first["beam"]))
        assert str(first).replace(str(tmp_path), "") == str(again).replace(str(tmp_path / "again"), "")
    assert (tmp_path / "record.csv").read_bytes() == (tmp_path / "again" / "record.csv").read_bytes()
    assert len(names) == 4


def test_a_key_without_a_rule_is_refused(tmp_path: Path) -> None:
    """Whoever adds a key says how it is drawn."""
    draw = Draw(random.Random(1), drawn_scene(random.Random(1), tmp_path, 1), CHOICES[0])
    with pytest.raises(NoRuleError, match=r"Unknown\.stiffness: say in benchmarks/drawn_schema/rules\.py"):
        draw.table(Unknown)


def test_tables_keep_nothing_beside_their_keys() -> None:
    """What is kept in a table is in its fields: pydantic 2.14 warns of anything else when a case is written."""

    def every(kind: type[Table]) -> Iterator[type[Table]]:
        for one in kind.__subclasses__():
            yield from (one, *every(one))

    kept = {f"{one.__name__}.{key}" for one in every(Table) for key, value in vars(one).items()
            if isinstance(value, cached_property)}  # fmt: skip
    assert len(list(every(Table))) > 100
    assert kept == set()
