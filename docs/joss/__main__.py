"""Build the paper as PDF: `make joss`, or `python -m docs.joss FILE` where requirements-joss.txt are.

Pandoc resolves the references, and typst sets the pages. A reference that paper.bib lacks ends the build,
as does a third page.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from pathlib import Path

import pypandoc
import typst

HERE = Path(__file__).parent
MOST_PAGES = 2


def typeset(folder: Path) -> Path:
    """Write the paper as a source of typst, with its pictures beside it, and return that file."""
    words = [
        "--citeproc",
        "--fail-if-warnings",
        f"--template={HERE / 'page.typ'}",
        f"--bibliography={HERE / 'paper.bib'}",
    ]
    text = pypandoc.convert_file(str(HERE / "paper.md"), "typst", extra_args=words)
    for name in re.findall(r'image\("([^"]+)"', text):
        shutil.copy(HERE / name, folder)
        text = text.replace(f'"{name}"', f'"{Path(name).name}"')
    page = folder / "paper.typ"
    page.write_text(text, encoding="utf-8")
    return page


def build(target: Path) -> None:
    """Write the paper as PDF.

    Args:
        target: The file; its folder is made.
    """
    with tempfile.TemporaryDirectory() as folder:
        page = typeset(Path(folder))
        drawn = typst.compile(str(page), format="svg")
        count = len(drawn) if isinstance(drawn, list) else 1
        if count > MOST_PAGES:
            sys.exit(f"docs/joss/paper.md: {count} pages; expected at most {MOST_PAGES}: shorten the text")
        target.parent.mkdir(parents=True, exist_ok=True)
        typst.compile(str(page), output=str(target))
    print(f"{target}: {count} pages")


if __name__ == "__main__":
    build(Path(sys.argv[1]).resolve())
