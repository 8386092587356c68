"""A block is copied whole: what belongs into a file, what is typed and what is printed stand in blocks of their own."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from docs.site.code_blocks import pieces
from tests.house.test_code_blocks import PAGES

PROJECT = Path(__file__).parents[2]


def mixed(text: str) -> list[int]:
    """Return the lines where blocks without a language begin that hold pieces of several kinds."""
    blocks = [token for token in MarkdownIt("commonmark").parse(text) if token.type == "code_block" and token.map]
    return [
        token.map[0] + 1 for token in blocks if token.map and len({kind for kind, _, _ in pieces(token.content)}) > 1
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(PROJECT)))
def test_blocks_are_of_one_kind(page: Path) -> None:
    """Two indented blocks with nothing but an empty line between them are one block to whoever reads the page."""
    assert mixed(page.read_text(encoding="utf-8")) == [], "write ```toml, ```sh and ```text"


def cut(text: str) -> list[int]:
    """Return the indented lines that continue a line at the margin: Markdown reads both as one paragraph."""
    tokens = MarkdownIt("commonmark").parse(text)
    lines = text.splitlines()
    found = []
    for opened, inline in pairwise(tokens):
        if opened.type == "paragraph_open" and opened.level == 0 and opened.map and inline.type == "inline":
            begin, end = opened.map
            found += [number + 1 for number in range(begin + 1, end) if lines[number].startswith("    ")]
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(PROJECT)))
def test_blocks_are_whole(page: Path) -> None:
    """No line of an indented block stands at the margin."""
    assert cut(page.read_text(encoding="utf-8")) == [], "indent every line of the block"


def test_cut_blocks_are_found() -> None:
    """A line at the margin ends the block, and begins a paragraph that swallows the rest."""
    assert cut("# A\n\n    import a\n\nb = a.c()\n    b.d()\n") == [6]
    assert cut("# A\n\n    import a\n\n    b = a.c()\n    b.d()\n") == []
    assert cut("# A\n\n* b\n    c\n\n```sh\nd\n    e\n```\n") == []


def test_mixed_blocks_are_found() -> None:
    """A table and a command make one block; a sentence or a fence between them makes two."""
    table, command = "    [beam]\n    length = 1.0\n", "    environment/run gapbeam run a.toml\n"
    assert mixed(f"# A\n\n{table}\n{command}") == [3]
    assert mixed(f"# A\n\n{table}\nThen\n\n{command}") == []
