"""A block is copied whole: what belongs into a file, what is typed and what is printed stand in blocks of their own."""

from __future__ import annotations

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


def test_mixed_blocks_are_found() -> None:
    """A table and a command make one block; a sentence or a fence between them makes two."""
    table, command = "    [beam]\n    length = 1.0\n", "    environment/run gapbeam run a.toml\n"
    assert mixed(f"# A\n\n{table}\n{command}") == [3]
    assert mixed(f"# A\n\n{table}\nThen\n\n{command}") == []
