"""Write the tables of docs/reference from the models of case and identification files.

python3 docs/tables/case_files.py
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path

from pydantic import BaseModel

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.known_keys import KeyTable, tables
from gapbeam.solver.case.reading.value_words import in_words, options, toml_value
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.table import models_in
from gapbeam.solver.wording.short_words import either
from gapbeam.studies.identification.identification_tables import Identification

REFERENCE = Path(__file__).resolve().parents[1] / "reference"
PAGES: dict[str, type[BaseModel]] = {
    "case-files.md": Case,
    "identification-files.md": Identification,
    "scene-files.md": SceneCase,
}
START, END = "<!-- tables: made by docs/tables/case_files.py -->\n", "<!-- end of tables -->\n"
HEAD = ("| key | value | default | meaning |", "|---|---|---|---|")


def reference(root: type[BaseModel]) -> str:
    """Return a Markdown table for every table of a file, and one for the keys above them."""
    above = KeyTable("title", root, "")
    loose = [key for key, field in root.model_fields.items() if not models_in(field.annotation)]
    rows = [_row(above, key) for key in loose]
    return "\n".join(["### Above all tables", "", *HEAD, *rows, "", *(_section(table) for table in tables(root))])


def _section(table: KeyTable) -> str:
    purpose = (inspect.getdoc(table.model) or "").split("\n")[0]
    kind = f' with `type = "{table.kind}"`' if table.kind else ""
    rows = [_row(table, key) for key in table.model.model_fields if key != "type"]
    return "\n".join([f"### `{table.header}`{kind}", "", purpose, *(["", *HEAD, *rows] if rows else []), ""])


def _row(table: KeyTable, key: str) -> str:
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


def page(name: str = "case-files.md") -> str:
    """Return a page with its tables made anew."""
    before, _, rest = (REFERENCE / name).read_text(encoding="utf-8").partition(START)
    return f"{before}{START}\n{reference(PAGES[name])}\n{END}{rest.partition(END)[2]}"


if __name__ == "__main__":
    for page_name in PAGES:
        (REFERENCE / page_name).write_text(page(page_name), encoding="utf-8")
