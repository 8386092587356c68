"""Words that made this code hard to read do not come back: in names, docstrings, comments, messages and pages."""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.house.test_docs import PAGES, ROOT_PAGES
from tests.house.test_house_rules import FILES, PROJECT

# What is hard to read, and what to write instead.
INSTEAD = {
    r"told|tells|telling|foretold|foretells?": "reported, says, determines, predicted",
    r"books": "ledger, diagnostics",
    r"course": "run consumers, function of time",
    r"stretch|stretches": "step block, interval",
    r"rungs?": "fidelity level, stage",
    r"ladders?": "fidelity levels",
    r"surroundings": "process environment, neighborhood",
    r"whatever became of|what(ever)? becomes? of|what became of": "result of",
    r"(goes|go|gone|going|went) on from": "continues from",
    r"left alone": "unchanged",
    r"that no one": "that nobody",
    r"what of a": "the part of a ... that",
    r"never begun": "interrupted before it began",
    r"in the place of": "instead of, replaces",
}
# Keys of files that earlier releases wrote and later ones read.
KEYS = re.compile(r"""["'`](told|rungs|ladder|change_from_last_rung)["'`]""")
# The command that published tables were made with.
COMMANDS = re.compile(r"benchmarks\.rungs|benchmarks/rungs|<!-- /?rungs -->")
WORDS = {re.compile(rf"\b({words})\b", re.IGNORECASE): instead for words, instead in INSTEAD.items()}
ANY = re.compile(rf"\b({'|'.join(INSTEAD)})\b", re.IGNORECASE)
CODE = sorted(
    {*FILES, *(path for folder in ("benchmarks", "docs", "tests") for path in (PROJECT / folder).rglob("*.py"))}
    - {Path(__file__), PROJECT / "benchmarks" / "rungs.py"}
)


def readable(text: str) -> Iterator[tuple[int, str]]:
    """Yield names in their words, comments and the lines of texts of a program, each with its line."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NAME:
            yield token.start[0], " ".join(re.findall(r"[A-Z]?[a-z]+|[A-Z]+", token.string))
        elif token.string.strip():
            yield from enumerate(token.string.splitlines(), start=token.start[0])


def hard_words(lines: Iterator[tuple[int, str]]) -> list[str]:
    """Return the hard words in some lines, with the number of their line and what to write instead."""
    return [
        f"{number}: {found[0]} -> {instead}"
        for number, line in lines
        if ANY.search(line)  # most have none: the rest is slow
        for word, instead in WORDS.items()
        if (found := word.search(COMMANDS.sub("", KEYS.sub("", line))))
    ]


@pytest.mark.parametrize("package", ["gapbeam", "benchmarks", "docs", "tests"])
def test_code_is_in_plain_words(package: str) -> None:
    """No name, docstring, comment or message of a package uses a hard word."""
    files = [path for path in CODE if path.relative_to(PROJECT).parts[0] == package]
    assert files
    wrong = [
        f"{path.relative_to(PROJECT)}:{found}"
        for path in files
        for found in hard_words(readable(path.read_text(encoding="utf-8")))
    ]
    assert wrong == []


@pytest.mark.parametrize("page", [*ROOT_PAGES, *PAGES], ids=lambda page: str(page.relative_to(PROJECT)))
def test_pages_are_in_plain_words(page: Path) -> None:
    """No page of the documentation uses a hard word."""
    assert hard_words(enumerate(page.read_text(encoding="utf-8").splitlines(), start=1)) == []


def test_hard_words_are_found() -> None:
    """In names, whole and as parts, in docstrings and messages; keys of files are none."""
    program = 'def told_by(rungTable):\n    """What became of it."""\n    return {"rungs": "goes on from there"}\n'
    assert [found.split(":")[0] for found in hard_words(readable(program))] == ["1", "1", "2", "3"]
