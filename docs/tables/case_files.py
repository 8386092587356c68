"""Write the tables of docs/reference from the models of case and identification files.

python3 docs/tables/case_files.py
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.known_keys import KeyTable, tables
from gapbeam.solver.case.reading.value_words import options, toml_value
from gapbeam.solver.messages.wording import either
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.schema.table import POINT_PATTERN, models_in
from gapbeam.studies.identification.identification_tables import Identification
from gapbeam.studies.library.library_file import LibraryStudy
from gapbeam.studies.optimum.optimum_study import OptimumStudy
from gapbeam.studies.uncertain.uncertain_file import UncertainStudy

REFERENCE = Path(__file__).resolve().parents[1] / "reference"
FIRST = "case-files.md"
UNCERTAIN = "uncertain-files.md"
LIBRARY = "library-files.md"
PAGES: dict[str, type[BaseModel]] = {
    FIRST: Case,
    "identification-files.md": Identification,
    "scene-files.md": SceneCase,
    UNCERTAIN: UncertainStudy,
    LIBRARY: LibraryStudy,
    "optimum-files.md": OptimumStudy,
}
ASSUMED = ["[gates.warnings]", "[gates.failures]"]
"""Tables whose keys stand on the page of the assumptions."""
START, END = "<!-- tables: made by docs/tables/case_files.py -->\n", "<!-- end of tables -->\n"
SHARED = 4
"""Rows that a table shares with one on the first page are named there, and values that rows share above their table."""
Row = tuple[str, str, str]
"""Key (bold where it is required), its default and what it may be, meaning."""


class Section(NamedTuple):
    """The tables that share a header: the sentence of each type, and each row with the types that have it."""

    purposes: tuple[tuple[str, str], ...]  # type, sentence
    rows: tuple[tuple[Row, tuple[str, ...]], ...]


def sections(root: type[BaseModel]) -> dict[Section, list[str]]:
    """Return the different sections of a file, each with the headers that have it."""
    together: dict[str, dict[str, KeyTable]] = {}
    for table in tables(root):
        together.setdefault(table.header, {})[table.kind] = table
    found: dict[Section, list[str]] = {}
    for header, kinds in together.items():
        rows: dict[Row, list[str]] = {}
        for kind, table in kinds.items():
            for key in table.model.model_fields:
                if key != "type":
                    rows.setdefault(_row(table.model, key), []).append(kind)
        purposes = tuple((kind, (inspect.getdoc(t.model) or "").split("\n")[0]) for kind, t in kinds.items())
        section = Section(purposes, tuple((row, tuple(of)) for row, of in _merged(rows).items()))
        found.setdefault(section, []).append(header)
    return found


def _merged(rows: Mapping[Row, list[str]]) -> dict[Row, list[str]]:
    """Return rows of which those that differ in a text as default alone are one, with all defaults."""
    defaults: dict[Row, dict[str, None]] = {}
    types: dict[Row, list[str]] = {}
    for (key, value, meaning), of in rows.items():
        default, semicolon, rest = value.partition("; ") if value.startswith('`"') else ("", "", value)
        row = (key, f"{semicolon}{rest}", meaning)
        defaults.setdefault(row, {})[default] = None
        types.setdefault(row, []).extend(of)
    return {
        (key, f"{', '.join(texts)}{rest}", meaning): types[key, rest, meaning]
        for (key, rest, meaning), texts in defaults.items()
    }


def reference(name: str) -> str:
    """Return the Markdown of all tables of a page; a page before it that has the same is linked."""
    root = PAGES[name]
    loose = [(row, ("",)) for row in _loose(root)]
    # the earliest page that has a section, and its heading there
    there: dict[Section, tuple[str, list[str]]] = {}
    for other in list(PAGES)[: list(PAGES).index(name)]:
        for section, headers in sections(PAGES[other]).items():
            there.setdefault(section, (other, headers))
    parts = ["### Above all tables", ""]
    if name == LIBRARY:
        parts += _kept(loose, set(_loose(PAGES[UNCERTAIN])), ("",), f"{UNCERTAIN}#above-all-tables", UNCERTAIN)
    else:
        parts += [*_table(loose, ("",)), ""]
    same: dict[tuple[Row, ...], str] = {}  # keys of a table without their units, and its heading
    elsewhere = list[str]()
    for section, headers in sections(root).items():
        if section in there:
            page_there, named = there[section]
            heading = _heading(named)
            address = f"{page_there}#{_anchor(heading)}"
            elsewhere.append(f"[{_heading(headers).replace('[', '').replace(']', '')}]({address})")
            continue
        parts += [f"### {_heading(headers)}", ""]
        keys = tuple((key, value, meaning.rpartition(", ")[0]) for (key, value, meaning), _ in section.rows)
        if same.setdefault(keys, _heading(headers)) != _heading(headers) and len(keys) >= SHARED:
            units = dict.fromkeys(meaning.rpartition(", ")[2] for (_, _, meaning), _ in section.rows)
            parts += [f"{section.purposes[0][1]} As {same[keys]}, in {either(units)}.", ""]
            continue
        kinds = section.purposes
        described = {kind for other, (_, named) in there.items() if headers[0] in named for kind in other.purposes}
        shared = [kind for kind in kinds if kind in described] if len(kinds) > 1 else []
        own = kinds if len(shared) < SHARED else [kind for kind in kinds if kind not in described]
        parts += [f"* `{kind}`: {words}" for kind, words in own] if kinds[0][0] else [kinds[0][1]]
        if len(own) < len(kinds):
            parts.append(f"* as in case files: {', '.join(f'`{kind}`' for kind, _ in shared)}")
        parts.append("")
        if headers == ASSUMED:
            named = ", ".join(key for key, _, _ in keys)
            parts += [f"Meanings and limits: [assumptions](../explanation/assumptions.md). Keys: {named}.", ""]
            continue
        known = {row for other, (_, named) in there.items() if headers[0] in named for row, _ in other.rows}
        parts += _kept(section.rows, known, tuple(k for k, _ in kinds), f"{FIRST}#{_anchor(_heading(headers))}", FIRST)
    if elsewhere:
        parts += ["### As on another page", "", f"{', '.join(elsewhere)}.", ""]
    return "\n".join(parts)


def _loose(root: type[BaseModel]) -> list[Row]:
    """Return the rows of keys above all tables."""
    return [_row(root, key) for key, field in root.model_fields.items() if not models_in(field.annotation)]


def _kept(
    rows: Sequence[tuple[Row, tuple[str, ...]]], known: set[Row], kinds: tuple[str, ...], address: str, page: str
) -> list[str]:
    """Return a table without the rows that another page has, and their keys with a link."""
    shared = dict.fromkeys(row[0] for row, _ in rows if row in known)
    kept = [row for row in rows if len(shared) < SHARED or row[0] not in known]
    lines = [*_table(kept, kinds), ""] if kept else []
    if len(shared) >= SHARED:
        title = page.removesuffix(".md").replace("-", " ")
        lines += [f"As in [{title}]({address}): {', '.join(shared)}.", ""]
    return lines


def _heading(headers: Iterable[str]) -> str:
    return ", ".join(f"`{header}`" for header in headers)


def _anchor(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading).replace(" ", "-")


def _types(types: tuple[str, ...], kinds: tuple[str, ...]) -> str:
    """Return the types that have a row: all, all but some, all with the same beginning, or their names."""
    others = [kind for kind in kinds if kind not in types]
    first = types[0].partition("_")[0] + "_"
    if len(types) > 1 and types == tuple(kind for kind in kinds if kind.startswith(first)):
        return f"{first}*"
    if len(types) < len(others) + 2:
        return ", ".join(types)
    return f"all but {', '.join(others)}" if others else "all"


def _table(rows: Sequence[tuple[Row, tuple[str, ...]]], kinds: tuple[str, ...]) -> Iterator[str]:
    """Yield a Markdown table: a column for types where there are several, one for values where they differ."""
    columns = [("key", [key for (key, _, _), _ in rows])]
    if len(kinds) > 1:
        columns.append(("types", [_types(types, kinds) for _, types in rows]))
    values = [value for (_, value, _), _ in rows]
    if len(rows) >= SHARED and len(set(values)) == 1:
        yield f"Each: {values[0]}.\n"
    else:
        columns.append(("value", values))
    columns.append(("meaning", [meaning for (_, _, meaning), _ in rows]))
    yield " | ".join(head for head, _ in columns)
    yield "|".join(["---"] * len(columns))
    for row in zip(*(cells for _, cells in columns), strict=True):
        yield " | ".join(row)


def _row(model: type[BaseModel], key: str) -> Row:
    field = model.model_fields[key]
    value = either(dict.fromkeys(short(option) for option in options(model, key)))
    meaning, _, derived = (field.description or "").partition("; default ")
    if field.default is None or field.is_required():
        default = derived
    elif isinstance(field.default, BaseModel) and not hasattr(field.default, "type"):
        default = ""
    else:
        default = f"`{toml_value(getattr(field.default, 'type', field.default))}`"
    if default.startswith("`") and default in value:
        value = value.replace(default, f"**{default}**")
    elif default:
        value = f"{default}; {value}"
    return (
        f"**`{key}`**" if field.is_required() else f"`{key}`",
        value,
        re.sub(r", no unit|: a name, or a table.*|, a table( with the type and its keys)?$", "", meaning),
    )


def short(schema: Mapping[str, Any]) -> str:
    """Return the values that a JSON schema allows, as short as they can be read."""
    if "const" in schema or "enum" in schema:
        return either(f"`{toml_value(value)}`" for value in schema.get("enum", [schema.get("const")]))
    kind = schema.get("type", "object")  # a reference to a table
    if kind in ("number", "integer"):
        whole, limits = "whole " * (kind == "integer"), _range(schema)
        return f"{whole}{limits}" if limits else f"{whole}number"
    if kind == "boolean":
        return "`true` or `false`"
    if kind == "string":
        pattern = schema.get("pattern")
        return "point" if pattern == POINT_PATTERN else "name" if pattern else "text"
    if kind == "object":
        return "table"
    if "prefixItems" in schema:
        items = schema["prefixItems"]
        return f"{len(items)} × {short(items[0])}"
    each = either(dict.fromkeys(short(item) for item in schema["items"].get("anyOf", [schema["items"]])))
    if each.startswith("list: <="):  # matrices, one or several
        return "rows of numbers"
    least, most = schema.get("minItems", 0), schema.get("maxItems")
    count = f"{least} to {most} × " if most and least else f"<= {most} × " if most else ""
    return f"list: {count}{each}"


def _range(schema: Mapping[str, Any]) -> str:
    """Return the range of a number, or ""."""
    if "minimum" in schema and "maximum" in schema:
        return f"{schema['minimum']:g} to {schema['maximum']:g}"
    signs = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}
    return ", ".join(f"{sign} {schema[limit]:g}" for limit, sign in signs.items() if limit in schema)


def page(name: str = FIRST) -> str:
    """Return a page with its tables made anew."""
    before, _, rest = (REFERENCE / name).read_text(encoding="utf-8").partition(START)
    return f"{before}{START}\n{reference(name)}\n{END}{rest.partition(END)[2]}"


if __name__ == "__main__":
    for page_name in PAGES:
        (REFERENCE / page_name).write_text(page(page_name), encoding="utf-8")
