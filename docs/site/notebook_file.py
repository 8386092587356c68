"""The notebook of a tutorial: its text and its Python as cells, without outputs.

`environment/run python3 -m docs.site.notebook_file` writes it anew; a test compares.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

TUTORIAL = Path(__file__).parents[1] / "tutorials" / "from-python.md"
PYTHON = re.compile(r"^```python\n(.*?)^```\n", re.MULTILINE | re.DOTALL)


def cells(page: str) -> list[tuple[str, str]]:
    """Return kind ("markdown" or "code") and text of the cells of a page: a code cell for each block of Python."""
    found: list[tuple[str, str]] = []
    for number, text in enumerate(PYTHON.split(page)):
        if text.strip():
            found.append(("code" if number % 2 else "markdown", text.strip("\n")))
    return found


def notebook(page: str) -> str:
    """Return the notebook of a page, as the text of an .ipynb file (format 4.5)."""
    made = [
        {
            "cell_type": kind,
            "id": f"cell-{number}",
            "metadata": {},
            "source": text.splitlines(keepends=True),
            **({"execution_count": None, "outputs": []} if kind == "code" else {}),
        }
        for number, (kind, text) in enumerate(cells(page))
    ]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    whole = {"cells": made, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    TUTORIAL.with_suffix(".ipynb").write_text(notebook(TUTORIAL.read_text(encoding="utf-8")), encoding="utf-8")
