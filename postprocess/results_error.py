"""The one error for results that cannot be read."""

from __future__ import annotations

from pathlib import Path


class ResultsError(Exception):
    """Results that are missing, truncated or of another format.

    Attributes:
        where: The file or folder.
        found: What is there.
        expected: What should be there.
        remedy: What to try.
    """

    def __init__(self, where: Path, found: str, expected: str, remedy: str) -> None:
        super().__init__(f"{where}: found {found}; expected {expected}. To try: {remedy}.")
        self.where = where
        self.found = found
        self.expected = expected
        self.remedy = remedy
