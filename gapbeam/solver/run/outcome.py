"""The result of a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gapbeam.solver.models.body import Body


@dataclass(frozen=True, repr=False)
class Outcome:
    """Result of a run.

    Attributes:
        folder: Where its results are.
        exit_status: 0, or the status of what went wrong.
        message: One line for the user.
        summary: The contents of summary.json.
        body: That of a small model on one process, for other models on it; None: it is not kept.
    """

    folder: Path
    exit_status: int
    message: str
    summary: dict[str, Any]
    body: Body | None = None

    def __repr__(self) -> str:
        return f"<Outcome: exit status {self.exit_status}: {self.message}; in {self.folder}>"
