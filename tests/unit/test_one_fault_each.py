"""One mistake in a valid case, in any table of the schema, is one fault: at its key and line, in its words."""

from __future__ import annotations

import random
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from pydantic import BaseModel

import gapbeam
from benchmarks.drawn_schema.attempts import drawn
from benchmarks.drawn_schema.tables import all_choices
from gapbeam.solver.case.case import Case, toml_value
from gapbeam.solver.case.reading.known_keys import candidates, check_types
from gapbeam.solver.case.reading.overrides import parse_value
from gapbeam.solver.case.reading.value_words import options
from gapbeam.solver.messages.errors import CaseError, Key
from gapbeam.studies.identification.identification_file import read_identification
from gapbeam.studies.library.library_file import read_library_study
from gapbeam.studies.optimum.optimum_study import read_optimum_study
from gapbeam.studies.uncertain.uncertain_file import read_uncertain
from tests.shared.case_texts import BEAM
from tests.shared.command import PROJECT

CHOICES = len(all_choices())


class Mistake(NamedTuple):
    """A case with one key spoiled: what was done, and the key as it stands now."""

    what: str
    tables: dict[str, Any]
    key: Key


def rows_of(tables: Mapping[str, Any], key: Key = ()) -> Iterator[tuple[Key, str]]:
    """Yield the rows of a case file with the key of each; every inner table has a header, every key a row."""
    for name, value in tables.items():
        if not isinstance(value, Mapping) and not is_entries(value):
            yield (*key, name), f"{name} = {toml_value(value)}"
    names = ".".join(str(part) for part in key if isinstance(part, str))
    for name, value in tables.items():
        dotted = f"{names}.{name}" if names else name
        if isinstance(value, Mapping):
            yield (*key, name), f"[{dotted}]"
            yield from rows_of(value, (*key, name))
        elif is_entries(value):
            for number, entry in enumerate(value):
                yield (*key, name, number), f"[[{dotted}]]"
                yield from rows_of(entry, (*key, name, number))


def is_entries(value: object) -> bool:
    """Return whether a value is an array of tables."""
    return isinstance(value, list | tuple) and bool(value) and all(isinstance(one, Mapping) for one in value)


def plain(value: Any) -> Any:
    """Return tables that may be changed."""
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items() if inner is not None}
    return [plain(inner) for inner in value] if isinstance(value, list | tuple) else value


def tables_in(tables: Any, key: Key = ()) -> Iterator[Key]:
    """Yield the key of every table of a case."""
    yield key
    for name, value in tables.items():
        if isinstance(value, Mapping):
            yield from tables_in(value, (*key, name))
        elif is_entries(value):
            for number, entry in enumerate(value):
                yield from tables_in(entry, (*key, name, number))


def at(tables: Any, key: Key) -> Any:
    """Return what stands at a key."""
    for part in key:
        tables = tables[part]
    return tables


def with_value(tables: Any, key: Key, value: object) -> dict[str, Any]:
    """Return a case with another value at a key."""
    changed = plain(tables)
    at(changed, key[:-1])[key[-1]] = value
    return changed


def misspelt(tables: Any, key: Key, chance: random.Random) -> Mistake:
    """Return a case with two letters of a key exchanged, or one doubled."""
    name = str(key[-1])
    place = chance.randrange(len(name) - 1)
    turned = name[:place] + name[place + 1] + name[place] + name[place + 2 :]
    wrong = turned if turned != name and len(name) > 4 else f"{name}{name[-1]}"
    changed = plain(tables)
    table = at(changed, key[:-1])
    kept = {(wrong if one == name else one): value for one, value in table.items()}
    table.clear()
    table.update(kept)
    return Mistake("misspelt", changed, (*key[:-1], wrong))


def of_wrong_type(tables: Any, key: Key) -> Mistake:
    """Return a case with a date, which no key takes, for a value."""
    return Mistake("of the wrong type", with_value(tables, key, {"nonsense": 1.0}), key)


def in_quotes(tables: Any, key: Key) -> Mistake:
    """Return a case with a number or switch, or the last number of a list, in quotes; a choice with a letter more."""
    value = at(tables, key)
    if isinstance(value, list):
        return Mistake("in quotes", with_value(tables, key, [*value[:-1], f"{value[-1]} mm"]), key)
    text = f"{value}{value[-1]}" if isinstance(value, str) else f"{value} mm"
    return Mistake("in quotes", with_value(tables, key, text), key)


def out_of_range(tables: Any, key: Key, model: type[BaseModel]) -> Mistake | None:
    """Return a case with a number just beyond the range that the schema gives; None where it gives none."""
    for option in options(model, str(key[-1])):
        for limit, step in (
            ("exclusiveMinimum", 0.0),
            ("minimum", -0.25),
            ("maximum", 0.25),
            ("exclusiveMaximum", 0.0),
        ):
            if limit in option and option.get("type") in ("number", "integer"):
                beyond = option[limit] + (4 * step if option["type"] == "integer" else step)
                return Mistake("out of range", with_value(tables, key, beyond), key)
    return None


def mistakes(tables: Any, chance: random.Random) -> Iterator[Mistake]:
    """Yield one mistake of each kind in each table of a case."""
    for table in tables_in(tables):
        models = candidates(table, tables)
        model = models[0] if len(models) == 1 else None
        known = [key for key in at(tables, table) if model and key in model.model_fields]
        if not known or model is Case:
            continue
        for name in chance.sample(known, min(2, len(known))):
            key = (*table, name)
            value = at(tables, key)
            yield misspelt(tables, key, chance)
            if name == "type" or (value and isinstance(value, list) and isinstance(value[0], float)):
                yield in_quotes(tables, key)
            if not isinstance(value, Mapping | list | tuple | str):
                yield in_quotes(tables, key)
            if not isinstance(value, Mapping | list | tuple):
                yield of_wrong_type(tables, key)
                if (beyond := out_of_range(tables, key, model)) is not None:
                    yield beyond


def assert_one_fault(mistake: Mistake, path: Path) -> None:
    """Check that a mistake is one fault, whose place has the line and the name of the key, and whose advice helps."""
    rows = list(rows_of(mistake.tables))
    path.write_text("\n".join(row for _, row in rows) + "\n", encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        gapbeam.read_case(path)
    line = next(number for number, (key, _) in enumerate(rows, start=1) if key == mistake.key)
    said = f"{mistake.what} {mistake.key}: {refused.value}"
    assert len(refused.value.faults) == 1, said
    [fault] = refused.value.faults
    assert fault.where.startswith(f"{path}:{line}: "), said
    assert str(mistake.key[-1]) in f"{fault.where} {fault.found}", said
    mended = followed(mistake, fault.hint)
    if mended is not None:
        assert check_types(mended)[1] == [], said


def followed(mistake: Mistake, advice: str) -> dict[str, Any] | None:
    """Return a case mended as the advice says; None where the advice names no key, value or sign."""
    name = str(mistake.key[-1])
    tables = plain(mistake.tables)
    table = at(tables, mistake.key[:-1])
    if word := re.search(r"did you mean `(\w+)`\?", advice):
        table[word[1]] = table.pop(name)
    elif word := re.search(r"did you mean (\"[\w-]+\")\?", advice):
        table[name] = tomllib.loads(f"value = {word[1]}")["value"]
    elif value := re.search(rf"\b{re.escape(name)} = ([^?]*?)(?:[?]| or |$)", advice):
        table[name] = tomllib.loads(f"value = {value[1]}")["value"]
    elif advice == "no minus sign":
        table[name] = -table[name]
    else:
        return None
    return tables


@pytest.mark.parametrize("seed", [3, 23, 40])
def test_one_mistake_is_one_fault(seed: int, tmp_path: Path) -> None:
    """Three cases: with a spectrum from a file and a load that names another, and with supports of several kinds."""
    assert_each_is_one_fault(seed, tmp_path)


@pytest.mark.slow(minutes=0.6)  # on a busy machine
@pytest.mark.parametrize("seed", range(CHOICES))
def test_one_mistake_in_any_table_is_one_fault(seed: int, tmp_path: Path) -> None:
    """A case for every choice of the schema."""
    assert_each_is_one_fault(seed, tmp_path)


def assert_each_is_one_fault(seed: int, folder: Path) -> None:
    """Check all mistakes in a drawn case."""
    tables, _ = drawn(seed, folder)
    found = list(mistakes(plain(tables), random.Random(seed)))
    assert len(found) > 20
    for one in found:
        assert_one_fault(one, folder / "case.toml")


ENTRY = '[[support]]\nname = "a"\nfrom = 0.5\nto = 0.6\nclearance = 1e-4\n'


@pytest.mark.parametrize(
    ("spoiled", "place", "words"),
    [
        (ENTRY.replace("[[support]]", "[support]"), "[support]", "two brackets: name, from, to belong there"),
        ("[support]\nfrom = 0.5\nto = 0.6\nclearance = 1e-4\n", "[support]", "from, to belong there, add name ="),
        ("[support]\nstart = 0.5\nend = 0.6\nclearance = 1e-4\n", "[support]", "from, to belong there, add name ="),
        ("[[support]]\nlength = 0.05\nclearance = 1e-4\n", "[[support]]", "single brackets: length belongs there"),
        (f'{ENTRY}[[model]]\ntype = "reduced"\n', "[[model]]", "write [model], with single brackets"),
        (f"{ENTRY}body = 3\n", "body", "body = { mass = 0.05, stiffness = 200000.0 }"),
        (f"{ENTRY}[probe]\npoint = 0.1\n", "[[probe]]", "two brackets"),
        (f'{ENTRY}region = ["stop"]\n', "region", 'did you mean "stop"?'),
        (f'{ENTRY}law = {{ type = "hunt-crossley", restitution = 5.0 }}\n', "restitution", "not more than 1"),
    ],
)
def test_unions_report_the_form_that_was_meant(spoiled: str, place: str, words: str, tmp_path: Path) -> None:
    """A table or an array of tables, one of several tables, a table or a name: one fault that says what to write."""
    (tmp_path / "case.toml").write_text(BEAM.partition("[[probe]]")[0] + spoiled, encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        gapbeam.read_case(tmp_path / "case.toml")
    [fault] = refused.value.faults
    assert fault.where.endswith(place)
    assert words in str(fault)


@pytest.mark.parametrize(
    ("typed", "value"),
    [
        (".025", 0.025),
        ("-.5", -0.5),
        ("2.", 2.0),
        ("1.e-3", 1e-3),
        ("[.01, 1., 2]", [0.01, 1.0, 2]),
        ('{ type = "newmark", beta = .25 }', {"type": "newmark", "beta": 0.25}),
        ("[\".5\", '1.']", [".5", "1."]),
        ("a.5", "a.5"),
        ("1.2.3", "1.2.3"),
        ("./case.msh", "./case.msh"),
    ],
)
def test_numbers_are_typed_as_people_type_them(typed: str, value: object) -> None:
    """A point lacks a digit on one side, in lists and tables, too; text in quotes, names and paths stay."""
    assert parse_value(typed) == value


def test_a_fault_within_an_override_names_its_key(tmp_path: Path) -> None:
    """The table was typed as a whole: the key in it is said."""
    case = tmp_path / "case.toml"
    case.write_text(BEAM + ENTRY, encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        gapbeam.read_case(case, ['contact={ law = { type = "hunt-crossley", restitution = -.5 } }'])
    assert [fault.where for fault in refused.value.faults] == ["`overrides=` contact: law.restitution"]


def test_keys_of_other_programs_are_one_fault_each(tmp_path: Path) -> None:
    """A place is `point` in a probe and `from` in a support: a length behind it brought two missing keys as well."""
    entry = ENTRY.replace("from = 0.5", "position = 0.5").replace("to = 0.6", "length = 0.1")
    section = 'section = { type = "tube", inner_diameter = 0.01 }\n'
    case = tmp_path / "case.toml"
    tube = BEAM.replace("[beam]\n", f"[beam]\n{section}")
    case.write_text(tube + entry.replace("clearance", "gap"), encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        gapbeam.read_case(case)
    meant = {"position": "from", "length": "to", "gap": "clearance", "inner_diameter": "wall"}
    found = {str(one.key[-1]): str(one) for one in refused.value.faults}
    assert set(found) == set(meant)
    for key, name in meant.items():
        assert ("it ends at `to`" if key == "length" else f"did you mean `{name}`?") in found[key]


PARTS_OF_TYPES = {
    "harmonic_force": ("force", "point = 0.3\namplitude = 2.0\nfrequency = 3.0"),
    "constant_force": ("force", "point = 0.3\namplitude = 2.0"),
    "step_force": ("step-force", "point = 0.3"),
    "random": ("randon", "point = 0.3\namplitude = 2.0"),
    "recorded_force": ("recorded", 'point = 0.3\nfile = "x.csv"'),
    "recorded_motion": ("recorded", 'file = "x.csv"'),
    "base_motion": ("motion", "amplitude = 1.0\nfrequency = 3.0"),
    "support_motion": ("motion", 'support = "base"\namplitude = 1.0\nfrequency = 3.0'),
    "recorded_support_motion": ("motion", 'support = "base"\nfile = "x.csv"'),
}


@pytest.mark.parametrize("name", PARTS_OF_TYPES)
def test_a_part_of_a_type_means_the_one_that_takes_the_keys(name: str, tmp_path: Path) -> None:
    """Several types have the word: the hint was the nearest spelling, a step for a harmonic force."""
    word, keys = PARTS_OF_TYPES[name]
    case = tmp_path / "case.toml"
    case.write_text(
        (PROJECT / "cases" / "demo.toml").read_text() + f'\n[[load]]\nname = "more"\ntype = "{word}"\n{keys}\n'
    )
    with pytest.raises(CaseError, match=f'did you mean "{name}"'):
        gapbeam.read_case(case)


@pytest.mark.parametrize("read", [read_library_study, read_optimum_study, read_uncertain, read_identification])
def test_hints_of_studies_name_what_is_missing(read: Callable[[Path], Any], tmp_path: Path) -> None:
    """Of an empty file each hint has keys with values: one read "add [recorded] with , "."""
    study = tmp_path / "study.toml"
    study.write_text("")
    with pytest.raises(CaseError) as refused:
        read(study)
    hints = [fault.hint for fault in refused.value.faults if fault.found.startswith(("nothing", "no "))]
    assert hints
    assert not [hint for hint in hints if re.search(r"with *(,|$)|, *(,|$)", hint)]
