"""A study: its command and the report on its results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gapbeam.postprocess.report.folder_report import Kind


@dataclass(frozen=True)
class StudyCommand:
    """A study as the command line offers it.

    Attributes:
        command: The command, with its options as typer reads them; returns the exit status.
        kind: Imports and returns the kind of results folder that the study writes, for reports; None: the study
            has no report of its own.
        collective: Whether the command runs under mpirun; otherwise the first rank runs it and the others refuse.
    """

    command: Callable[..., int]
    kind: Callable[[], Kind] | None = None
    collective: bool = False
