"""Errors of `postprocess`; each has the `exit_status` of the command line."""

from __future__ import annotations

from pathlib import Path


class ResultsError(Exception):
    """Results that are missing, truncated or of another format.

    Attributes:
        where: The file or folder.
        found: The finding.
        expected: The expectation.
        remedy: Advice.
    """

    exit_status = 2

    def __init__(self, where: Path, found: str, expected: str, remedy: str) -> None:
        super().__init__(f"{where}: found {found}; expected {expected}. To try: {remedy}.")
        self.where = where
        self.found = found
        self.expected = expected
        self.remedy = remedy


class OptionError(ValueError):
    """An option of `plot` or `render` that is out of range."""

    exit_status = 2


class BlockError(ValueError):
    """A block of a report that contradicts itself."""
