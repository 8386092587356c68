"""The code blocks of the pages, and what each part of a block is: a case file, commands, Python or text.

Pages indent most blocks, and a block may hold a piece of a case file above the command that runs it. So a block is cut
at empty lines, and what a piece is follows from its first line. A block that begins with Python is Python.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Literal, NamedTuple

from markdown_it import MarkdownIt

Kind = Literal["toml", "sh", "python", "text"]

COMMAND = re.compile(
    r"(\w+=\S+ +|\w+='[^']*' +|\w+=\"[^\"]*\" +)*"
    r"(environment/\w+|gapbeam|dask|make|git|cd|sbatch|docker|mpirun|apt|apt-get|pip|python3|conda|export|sudo)( |$)"
)
TABLE_OR_KEY = re.compile(r"\[{1,2}[\w.-]+\]{1,2}\s*(#.*)?$|[a-z_]+ *= *([\[{\"']|-?[0-9]|true|false)")
PYTHON = re.compile(r"(from [\w.]+ )?import \w|\w+ = gapbeam\.")
NAMES = {"sh": "sh", "shell": "sh", "bash": "sh", "toml": "toml", "python": "python", "text": "text", "": ""}


class Block(NamedTuple):
    """A piece of code on a page, of one kind."""

    page: Path
    line: int
    kind: Kind
    text: str
    named: bool  # the page says of which kind it is

    def commands(self) -> list[list[str]]:
        """Return the words of each command of a block of kind sh, without comments."""
        lines = re.sub(r"\\\n\s*", " ", self.text).splitlines()
        return [words for line in lines if (words := shlex.split(line, comments=True))]


def kind_of(text: str) -> Kind:
    """Return what the first line of a piece looks like; comments do not count."""
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    if COMMAND.match(first):
        return "sh"
    if TABLE_OR_KEY.match(first):
        return "toml"
    return "python" if PYTHON.match(first) else "text"


def blocks(page: Path) -> Iterator[Block]:
    """Yield the blocks of a page, each cut into pieces of one kind."""
    for token in MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8")):
        if token.type not in ("fence", "code_block") or token.map is None:
            continue
        name = NAMES.get(token.info.strip(), "text")
        begin = token.map[0] + (2 if token.type == "fence" else 1)
        if name:
            yield Block(page, begin, name, token.content, named=True)  # type: ignore[arg-type]
            continue
        for kind, text, offset in pieces(token.content):
            yield Block(page, begin + offset, kind, text, named=False)


def pieces(text: str) -> Iterator[tuple[Kind, str, int]]:
    """Yield kind, text and first line (from 0) of the pieces of a block; neighbors of one kind are one piece."""
    if kind_of(text) == "python":
        yield "python", text, 0
        return
    found = [(kind_of(match[0]), match.start(), match.end()) for match in re.finditer(r"(?:^.*\S.*\n?)+", text, re.M)]
    for kind, group in groupby(found, key=lambda piece: piece[0]):
        together = list(group)
        begin, end = together[0][1], together[-1][2]
        yield kind, text[begin:end], text.count("\n", 0, begin)
