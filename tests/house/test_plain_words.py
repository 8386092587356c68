"""Words that made this code hard to read do not come back: in names, docstrings, comments, messages and pages."""

from __future__ import annotations

import ast
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
# Programs name the noun again: "the clearance of the hole", not "that of the hole".
STANDS_FOR = re.compile(r"\bthat of the\b", re.IGNORECASE)
# Docstrings begin with a noun or a verb: none of these opens one.
OPENERS = re.compile(
    r"(what|how|whether|which|why|when|where|who|whose|that|those|this|these|it|they"
    r"|of|by|from|as|in|on|at|to|not|if|for|with|does|is|are"
    r"|(return|yield) (what|how|where|which|why|that of|those))\b",
    re.IGNORECASE,
)
# Entries of docstrings name things, too: "station of each point", not "that of each point" or "of each point".
ENTRY_OPENERS = re.compile(
    r"(it|they|them|theirs|that|those|this|these|what(ever)?|which|who|whose|how|its own|one of (them|these|those)"
    r"|where|when|of|by|in|at|on|from|to|with|without|over|under|along|across|between|after|before|beside|below|above|within"
    r"|there (is|are) (none|one|any|such|more)(?=[.,;])|likewise(?=[.,;]))\b",
    re.IGNORECASE,
)
SECTION = re.compile(r"(Args|Attributes|Raises|Returns|Yields):")
# Keys of files that earlier releases wrote and later ones read.
KEYS = re.compile(r"""["'`](told|rungs|ladder|change_from_last_rung)["'`]""")
WORDS = {re.compile(rf"\b({words})\b", re.IGNORECASE): instead for words, instead in INSTEAD.items()}
ANY = re.compile(rf"\b({'|'.join(INSTEAD)})\b", re.IGNORECASE)
CODE = sorted(
    {*FILES, *(path for folder in ("benchmarks", "docs", "tests") for path in (PROJECT / folder).rglob("*.py"))}
    - {Path(__file__)}
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
        if (found := word.search(KEYS.sub("", line)))
    ]


def docstrings(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the docstrings of a program, and the texts below its constants and attributes, each with its line."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if not isinstance(body, list):
            continue
        for statement in body:
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                text = statement.value.value
                if isinstance(text, str):
                    yield statement.lineno, text.strip()


def unclear(program: str) -> list[str]:
    """Return the docstrings of a program that open with one of `OPENERS`."""
    found = [(line, text) for line, text in docstrings(ast.parse(program)) if OPENERS.match(text)]
    return [f"{line}: {text.splitlines()[0].strip()}" for line, text in sorted(found)]


def entries(text: str) -> Iterator[tuple[int, str]]:
    """Yield the entries of the sections of a docstring without their names, each with its line in the docstring."""
    section, deep, names = -1, -1, False
    for number, line in enumerate(text.splitlines()):
        depth = len(line) - len(line.lstrip())
        if found := SECTION.fullmatch(line.strip()):
            section, deep, names = depth, -1, found[1] not in ("Returns", "Yields")
        elif line.strip() and depth <= section:
            section = -1
        elif line.strip() and section >= 0 and (deep < 0 or (names and depth == deep)):
            deep = depth
            yield number, re.sub(r"^[\w*., ]+(\(.*?\))?: ", "", line.strip()) if names else line.strip()


def unclear_entries(program: str) -> list[str]:
    """Return the entries of the docstrings of a program that open with one of `ENTRY_OPENERS`."""
    found = [
        (line + number, entry)
        for line, text in docstrings(ast.parse(program))
        for number, entry in entries(text)
        if ENTRY_OPENERS.match(entry)
    ]
    return [f"{line}: {entry}" for line, entry in sorted(found)]


@pytest.mark.parametrize("package", ["gapbeam", "benchmarks", "docs", "tests"])
def test_entries_name_things(package: str) -> None:
    """Entries of arguments, attributes, errors and returned values begin with a noun: no pronoun, no preposition."""
    files = [path for path in CODE if path.relative_to(PROJECT).parts[0] == package]
    assert files
    wrong = [
        f"{path.relative_to(PROJECT)}:{found}" for path in files for found in unclear_entries(path.read_text("utf-8"))
    ]
    assert wrong == []


def test_unclear_entries_are_found() -> None:
    """In all sections, not in lines that continue an entry, nor in names and texts around."""
    program = (
        'def gap(it, mass):\n    """Return a gap.\n\n    That is its size.\n\n    Args:\n        it: Beam,\n'
        "            that is its size.\n        mass (kg, moved): That of the beam.\n        load: Of it, N.\n\n"
        "    Returns:\n        What is open, m:\n        that is its size.\n\n"
        "    Raises:\n        ValueError: It is closed.\n\n"
        '    Those are its parts.\n    """\n'
    )
    assert [found.split(":")[0] for found in unclear_entries(program)] == ["9", "10", "13", "17"]


@pytest.mark.parametrize("package", ["gapbeam", "benchmarks"])
def test_docstrings_name_things(package: str) -> None:
    """Docstrings begin with a noun or a verb."""
    files = [path for path in CODE if path.relative_to(PROJECT).parts[0] == package]
    assert files
    wrong = [f"{path.relative_to(PROJECT)}:{found}" for path in files for found in unclear(path.read_text("utf-8"))]
    assert wrong == []


def test_unclear_docstrings_are_found() -> None:
    """At the start of modules, classes, functions and texts below constants; verbs are fine."""
    program = (
        '"""What a beam is."""\nPLAY = 1\n"""Of a support, m."""\n\n\nclass Gap:\n    """How wide it is."""\n\n'
        '    def open(self) -> bool:\n        """Whether it is."""\n\n    def close(self) -> None:\n'
        '        """Return nothing: whether it closes depends on the mass."""\n\n    def mass(self) -> float:\n'
        '        """Return what closes."""\n'
    )
    assert [found.split(":")[0] for found in unclear(program)] == ["1", "3", "7", "10", "16"]


@pytest.mark.parametrize("package", ["gapbeam", "benchmarks", "docs", "tests"])
def test_code_is_in_plain_words(package: str) -> None:
    """No name, docstring, comment or message of a package uses a hard word, or "that of the" instead of a noun."""
    files = [path for path in CODE if path.relative_to(PROJECT).parts[0] == package]
    assert files
    wrong = [
        f"{path.relative_to(PROJECT)}:{found}"
        for path in files
        for found in hard_words(readable(path.read_text(encoding="utf-8")))
    ]
    wrong += [
        f"{path.relative_to(PROJECT)}:{number}: {line.strip()}"
        for path in files
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if STANDS_FOR.search(line)
    ]
    assert wrong == []


@pytest.mark.parametrize("page", [*ROOT_PAGES, *PAGES], ids=lambda page: str(page.relative_to(PROJECT)))
def test_pages_are_in_plain_words(page: Path) -> None:
    """No page of the documentation uses a hard word, or "that of the" instead of a noun."""
    lines = page.read_text(encoding="utf-8").splitlines()
    assert hard_words(enumerate(lines, start=1)) == []
    assert [f"{number}: {line}" for number, line in enumerate(lines, start=1) if STANDS_FOR.search(line)] == []


def test_hard_words_are_found() -> None:
    """In names, whole and as parts, in docstrings and messages; keys of files are none."""
    program = 'def told_by(rungTable):\n    """What became of it."""\n    return {"rungs": "goes on from there"}\n'
    assert [found.split(":")[0] for found in hard_words(readable(program))] == ["1", "1", "2", "3"]
