"""Write the tables of docs/case-files.md from the models of the case file: python3 docs/case_files.py."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from solver.case import Case
from solver.case_file.keys import Table, models_in, tables
from solver.case_file.words import either, in_words, options, toml_value

PAGE = Path(__file__).with_name("case-files.md")
START, END = "<!-- tables: made by docs/case_files.py -->\n", "<!-- end of tables -->\n"
HEAD = ("| key | value | default | meaning |", "|---|---|---|---|")


def reference() -> str:
    """Return a Markdown table for every table of the case file, and one for the keys above them."""
    above = Table("title", Case, "")
    loose = [key for key, field in Case.model_fields.items() if not models_in(field.annotation)]
    rows = [_row(above, key) for key in loose]
    return "\n".join(["### Above all tables", "", *HEAD, *rows, "", *(_section(table) for table in tables())])


def _section(table: Table) -> str:
    purpose = (inspect.getdoc(table.model) or "").split("\n")[0]
    kind = f' with `type = "{table.kind}"`' if table.kind else ""
    rows = [_row(table, key) for key in table.model.model_fields if key != "type"]
    return "\n".join([f"### `{table.header}`{kind}", "", purpose, *(["", *HEAD, *rows] if rows else []), ""])


def _row(table: Table, key: str) -> str:
    field = table.model.model_fields[key]
    value = either(dict.fromkeys(in_words(option) for option in options(table.model, key)))
    meaning, _, derived = (field.description or "").partition("; default ")
    if field.is_required():
        default = "required"
    elif field.default is None:
        default = derived or "none"
    else:
        default = f"`{toml_value(getattr(field.default, 'type', field.default))}`"
    return f"| `{key}` | {value} | {default} | {meaning} |"


def page() -> str:
    """Return the page with its tables made anew."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(START)
    return f"{before}{START}\n{reference()}\n{END}{rest.partition(END)[2]}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
