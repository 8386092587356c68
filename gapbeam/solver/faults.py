"""Faults of a case file: where, what was found, what was expected, what to try."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

LONGEST = 500  # characters of what was found

Key = tuple[str | int, ...]
"""The way to a value in a case file: ("support", "clearance"), ("load", 1, "amplitude")."""


@dataclass(frozen=True)
class Fault:
    """One fault, made to be read by the person who wrote the case file.

    The checks know the key and the other keys that take part in a contradiction (`related`);
    `reading.case_reader` adds `where`, the place in words with file and line, before anybody reads it. `lacks` names
    the arrays of tables in which an entry was looked for and not found: none is missed where one is faulty itself.
    """

    key: Key
    found: str
    expected: str
    hint: str = ""
    related: tuple[Key, ...] = ()
    where: str = ""
    lacks: tuple[str, ...] = ()

    def __str__(self) -> str:
        lines = [_short(self.where), f"  found:    {_short(self.found)}", f"  expected: {self.expected}"]
        if self.hint:
            lines.append(f"  try:      {self.hint}")
        return "\n".join(lines)


def _short(words: str) -> str:
    """Return words of the user's in one line that can be read."""
    line = words.replace("\n", "\\n")
    return line if len(line) <= LONGEST else f"{line[:LONGEST]} ... ({len(line)} characters)"


NOTHING_RUN = "nothing was run."


def in_one_line(message: str) -> str:
    """Return the first line of a message, or the first fault of a case that was refused.

    Args:
        message: That of an error, such as `str(CaseError)`.
    """
    lines = [line.strip() for line in message.strip().splitlines() if line.strip()] or [""]
    if not lines[0].endswith(NOTHING_RUN) or len(lines) < 2:
        return lines[0]
    place = lines[1][max(lines[1].find("["), 0) :]
    words = [" ".join(line.split()) for line in lines[2:4] if line.startswith(("found:", "expected:"))]
    return f"{place}: {', '.join(words)}"


class CaseError(Exception):
    """A case that cannot be run, with all its faults; `str()` is the whole message."""

    exit_status = 2

    def __init__(self, source: str, faults: Sequence[Fault]) -> None:
        super().__init__(source, faults)
        self.source = source
        self.faults = tuple(faults)

    def __str__(self) -> str:
        count = "a fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        return "\n\n".join([f"{self.source} has {count}; {NOTHING_RUN}", *map(str, self.faults)])
