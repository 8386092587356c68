r"""What is executed for a page: its `gapbeam` commands and its Python, in their order, and the cases that it saves.

A comment before a block, which no reader of the page sees, says how the block is executed:

    <!-- save as: first.toml -->           the block is a case file; later commands find it under this name
    <!-- run with: --set time.end=0.05 --> options added to every `gapbeam run` of the block; other commands likewise
    <!-- replace: CASE -> cases/demo.toml -->  a text of the block, replaced before it is executed
    <!-- first: gapbeam run cases/demo.toml -->  a command that the block needs, executed before it
    <!-- input: my-data.txt = 0 1 -->      a file that the block reads; `\n` ends a line
    <!-- ends with: 5 -->                  the exit status that is expected of the last command; otherwise 0
    <!-- output within: 2 % -->            the block is what the last command or program of the block before prints; its
                                           numbers may be off by so much, and "..." stands for anything
    <!-- not run: reason -->               the block is not executed
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Literal, NamedTuple

from markdown_it import MarkdownIt

from docs.site.code_blocks import Block, blocks

NOTE = re.compile(
    r"<!-- (save as|[a-z]+ with|output within|replace|first|input|ends with|not run): (.*?) -->", re.DOTALL
)


class Step(NamedTuple):
    """One thing to do for a page: a command, a program, or a file to write."""

    line: int
    kind: Literal["command", "python", "file", "output"]
    text: str  # the command, the program, the content of the file, or what the step before prints
    status: int = 0  # the exit status that is expected
    file: str = ""
    within: float = 0.0  # by how much numbers of an output may be off, as a fraction


def notes_of(page: Path) -> dict[int, list[tuple[str, str]]]:
    """Return the notes before each block of a page that has some, by the line where the block begins."""
    found: dict[int, list[tuple[str, str]]] = {}
    waiting: list[tuple[str, str]] = []
    for token in MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8")):
        if token.type == "html_block":
            waiting += NOTE.findall(token.content)
        elif token.type in ("fence", "code_block") and token.map:
            found[token.map[0] + (2 if token.type == "fence" else 1)] = waiting
            waiting = []
    if waiting:
        raise ValueError(f"{page}: a note on how to execute a block stands before no block: {waiting}")
    return found


def gapbeam_command(words: list[str]) -> list[str] | None:
    """Return a command from its word `gapbeam` on, or None where another program is called."""
    kept = [word for word in words if word != "environment/run"]
    return kept if kept[:1] == ["gapbeam"] else None


def with_options(words: list[str], more: list[str]) -> str:
    """Return a command as text, with more options before what its output is written to."""
    end = next((place for place, word in enumerate(words) if word in (">", "|", "&&")), len(words))
    before, after = [*words[:end], *more], words[end:]
    return " ".join([shlex.join(before), *(word if word in (">", "|", "&&") else shlex.quote(word) for word in after)])


def block_steps(block: Block, notes: list[tuple[str, str]]) -> Iterator[Step]:
    """Yield what is executed for a block."""
    if "not run" in dict(notes):
        return
    text = block.text
    more: dict[str, list[str]] = {}
    status = 0
    for name, value in notes:
        if name == "replace":
            old, new = value.split(" -> ")
            if old not in text:
                raise ValueError(f"{block.page}:{block.line}: {old!r} is not in the block")
            text = text.replace(old, new)
        elif name == "first":
            yield Step(block.line, "command", value)
        elif name == "input":
            file, content = value.split(" = ")
            yield Step(block.line, "file", content.replace("\\n", "\n") + "\n", file=file)
        elif name == "ends with":
            status = int(value)
        elif name == "output within":
            yield Step(block.line, "output", text, within=0.01 * float(value.removesuffix("%")))
            return
        elif name.endswith(" with"):
            more[name.removesuffix(" with")] = shlex.split(value)
        elif name == "save as" and block.kind == "toml":
            yield Step(block.line, "file", text, file=value)
            return
    if block.kind == "python":
        yield Step(block.line, "python", text, status)
    elif block.kind == "sh":
        called = [words for line in block._replace(text=text).commands() if (words := gapbeam_command(line))]
        for number, words in enumerate(called):
            yield Step(
                block.line,
                "command",
                with_options(words, more.get(words[1], [])),
                status if number == len(called) - 1 else 0,
            )


def page_steps(page: Path) -> list[Step]:
    """Return what is executed for a page; Python blocks without a command between them are one program."""
    notes = notes_of(page)
    begins = sorted(notes)
    steps = [
        step
        for block in blocks(page)
        for step in block_steps(block, notes[max(begin for begin in begins if begin <= block.line)])
    ]
    joined: list[Step] = []
    for kind, group in groupby(steps, key=lambda step: step.kind):
        together = list(group)
        if kind == "python":
            joined.append(together[0]._replace(text="\n".join(step.text for step in together)))
        else:
            joined += together
    return joined
