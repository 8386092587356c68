"""Build the site of the documentation: `make docs`, or `python -m docs.site FOLDER` where requirements-docs.txt are.

The pages stay where they are. They are copied, some with words for the search, the index gets the tables of contents
that its own links say, and two pages are made from the code: all commands, and the Python interface. A broken link
inside the site ends the build.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from sphinx.cmd.build import main as sphinx

from docs.site.all_commands import commands_page
from docs.site.contents import with_contents
from docs.site.python_interface import interface_page
from docs.site.search_words import SEARCH_WORDS, with_search_words

DOCS = Path(__file__).parents[1]
MADE = {"reference/all-commands.md": commands_page, "reference/python-interface.md": interface_page}
PAPER = DOCS / "joss"  # set by `make joss`
KEPT = (".md", ".png", ".svg", ".gif", ".ipynb")


def copied(target: Path) -> None:
    """Copy the pages and pictures into a folder, and make there what is made from the code."""
    for path in sorted(DOCS.rglob("*")):
        if path.suffix in KEPT and path.parent != PAPER:
            copy = target / path.relative_to(DOCS)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, copy)
    for name, page in MADE.items():
        (target / name).write_text(page(), encoding="utf-8")
    for name, words in SEARCH_WORDS.items():
        searched = target / name
        searched.write_text(with_search_words(searched.read_text(encoding="utf-8"), words), encoding="utf-8")
    index = target / "index.md"
    index.write_text(with_contents(index.read_text(encoding="utf-8"), {"Reference": list(MADE)}), encoding="utf-8")


def build(site: Path) -> int:
    """Build the site into a folder and return the exit status of Sphinx; what it warns of are faults."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        copied(source)
        words = ["-b", "html", "-q", "-W", "--keep-going", "-c", str(DOCS / "site"), "-d", str(Path(folder) / "trees")]
        return sphinx([*words, str(source), str(site)])


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1]).resolve()))
