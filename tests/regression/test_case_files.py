"""The shipped cases, the JSON schema and the page on case files agree with the models."""

from __future__ import annotations

import json
import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.json_schema import schema, unit_in
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.known_keys import tables
from tests.shared.case_texts import GOOD, spoiled

ROOT = Path(__file__).parents[2]
CASES = sorted((ROOT / "cases").glob("*.toml"))
NAMES = [path.stem for path in CASES]
SOFT = {"li2013-adams": "the weight presses the beam 1.1e-05 m into it"}  # the contact that the paper prints is soft


@pytest.mark.parametrize("path", CASES, ids=NAMES)
def test_a_shipped_case_is_valid(path: Path) -> None:
    case = read_case(path)
    assert case.title
    assert {probe.name for probe in case.probe} >= {"tip"}
    assert [line for line in warnings(case) if SOFT.get(path.stem, "none") not in line] == []


@pytest.mark.parametrize("path", CASES, ids=NAMES)
def test_a_shipped_case_says_what_it_shows_costs_and_how_to_run_it(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    opening = text.partition("\n\n")[0]
    assert all(line.startswith("#") for line in opening.split("\n"))
    for word in ("# Shows ", "# Costs ", "# Run ", "# Plot "):
        assert word in opening
    assert f"gapbeam run cases/{path.name}" in opening
    for line in text.split("\n"):
        if " = " in line and not line.startswith(("#", "title", "type", "name")):
            assert "#" in line, f"no comment behind {line}"


def test_the_cases_of_the_issue_are_shipped() -> None:
    assert {"demo", "li2013", "li2013-2d", "clamped"} <= set(NAMES)


def test_the_paper_is_transcribed_faithfully() -> None:
    case = read_case(ROOT / "cases/li2013.toml")
    assert (case.beam.length, case.beam.width, case.beam.thickness) == (0.510, 0.020, 0.012)
    assert (case.material.young_modulus, case.material.poisson_ratio, case.material.density) == (
        2.1e11,
        0.3,
        7919.0,
    )
    assert (case.support.length, case.support.clearance) == (0.050, 0.107e-3)
    assert case.probe[0].point == 0.370
    assert read_case(ROOT / "cases/clamped.toml").support.clearance == -0.006e-3


def test_the_slice_differs_from_the_solid_in_its_mesh_alone() -> None:
    solid, flat = (read_case(ROOT / f"cases/{name}.toml") for name in ("li2013", "li2013-2d"))
    across = flat.restraint.model_copy(update={"lateral": solid.restraint.lateral})  # a slice does not move there
    assert flat.model_copy(update={"mesh": solid.mesh, "title": solid.title, "restraint": across}) == solid


def test_the_schema_describes_every_key() -> None:
    document = schema()
    assert document["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert document["title"] == "gapbeam case file"
    assert document["required"] == ["beam", "material", "support", "time"]
    assert "null" not in json.dumps(document)
    for table in tables():
        described = document["$defs"][table.model.__name__]
        assert described["additionalProperties"] is False
        for key in table.model.model_fields:
            assert described["properties"][key]["description"]


def test_the_schema_accepts_the_shipped_cases_and_refuses_bad_ones() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    import tomllib

    document = schema()
    jsonschema.Draft202012Validator.check_schema(document)
    check = jsonschema.Draft202012Validator(document)

    def accepts(text: str) -> bool:
        return bool(check.is_valid(tomllib.loads(text)))

    assert accepts(GOOD)
    assert all(accepts(path.read_text(encoding="utf-8")) for path in CASES)
    assert accepts(spoiled('"discrete-gradient"', '{ type = "newmark", beta = 0.3 }'))
    assert accepts(GOOD + '[analysis]\nstart = "undeformed"\n')
    assert not accepts(GOOD + '[analysis]\nmethod = "shooting"\n')
    assert not accepts(spoiled("width", "widht"))
    assert not accepts(spoiled("width = 0.020", 'width = "0.020"'))
    assert not accepts(spoiled('"discrete-gradient"', '"newmrk"'))
    assert not accepts(spoiled('type = "gravity"', 'type = "gravitation"'))


def misspelled(tables: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield each key of a case, misspelled, with the case that has it so."""
    for key, value in tables.items():
        if key != "type":
            changed = {f"{name}_x" if name == key else name: one for name, one in tables.items()}
            yield f"{key}_x", changed
        parts = value if isinstance(value, list) else [value]
        for number, part in enumerate(parts):
            for word, inner in misspelled(part) if isinstance(part, dict) else ():
                kept = [*parts[:number], inner, *parts[number + 1 :]]
                yield word, {**tables, key: kept if isinstance(value, list) else inner}


@pytest.mark.parametrize("path", CASES, ids=NAMES)
def test_a_validator_names_every_misspelled_key(path: Path) -> None:
    """A message of jsonschema has the key itself, also in tables of several types; none says that nothing fits."""
    jsonschema = pytest.importorskip("jsonschema")
    import tomllib

    check = jsonschema.Draft202012Validator(schema())
    cases = list(misspelled(tomllib.loads(path.read_text(encoding="utf-8"))))
    assert len(cases) > 20
    for word, tables_so in cases:
        messages = [one.message for one in check.iter_errors(tables_so)]
        assert any(f"'{word}'" in message for message in messages), (word, messages)
        assert not any("under any" in message or "oneOf" in message for message in messages), messages


def test_a_validator_names_types_and_forms() -> None:
    """A mistyped name of a scheme, of a load and of a region: where it stands, and which names there are."""
    jsonschema = pytest.importorskip("jsonschema")
    import tomllib

    check = jsonschema.Draft202012Validator(schema())

    def said(text: str) -> list[tuple[str, str]]:
        return [(one.json_path, one.message) for one in check.iter_errors(tomllib.loads(text))]

    [(place, message)] = said(spoiled('"discrete-gradient"', '"newmrk"'))
    assert place == "$.time.scheme"
    assert "'newmark'" in message
    [(place, message)] = said(spoiled('type = "gravity"', 'type = "gravitation"'))
    assert place.endswith(".type")
    assert "'gravity'" in message
    text = (ROOT / "cases/tube-holes.toml").read_text(encoding="utf-8")
    [(place, message)] = said(text.replace('region = "hole"', 'region = "whole"', 1))
    assert place == "$.support[0].region"
    assert "'hole'" in message


def test_every_description_ends_with_a_unit_or_names_none() -> None:
    for table in tables():
        for key, field in table.model.model_fields.items():
            annotation = str(field.annotation)
            if "float" in annotation:
                assert unit_in(field.description or ""), f"{table} {key}: {field.description}"


def test_the_page_on_case_files_is_up_to_date() -> None:
    made: dict[str, Any] = runpy.run_path(str(ROOT / "docs/tables/case_files.py"), run_name="docs")
    for name in made["PAGES"]:
        there = (ROOT / "docs/reference" / name).read_text(encoding="utf-8")
        assert made["page"](name) == there, "run: python3 docs/tables/case_files.py"
    text = (ROOT / "docs/reference/case-files.md").read_text(encoding="utf-8")
    for table in tables():
        assert table.header in text
        assert all(f"`{key}`" in text for key in table.model.model_fields if key != "type")


def test_the_examples_of_the_page_work() -> None:
    text = (ROOT / "docs/reference/case-files.md").read_text(encoding="utf-8")
    overrides = re.findall(r"--set '?([a-z_.0]+=(?:\[[^]]*]|[^\s'`]+))", text)
    assert len(overrides) >= 6
    read_case(ROOT / "cases/demo.toml", overrides)
