"""Parts of commands: terminal output, progress bars, options for workers, and studies with their reports."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.progress import Progress

    from gapbeam.postprocess.report.folder_report import Kind
    from gapbeam.studies.engine.workers import Workers
LOG = logging.getLogger("gapbeam")
LINE = 30.0  # s between plain lines where there is no terminal


def screen(width: int) -> Console:
    """Return the console of tables; without a terminal to fit them to they have so many columns."""
    from rich.console import Console

    console = Console(soft_wrap=True, highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, width)
    return console


def print_study(tables: Iterable[RenderableType], lines: Iterable[object], width: int = 160) -> None:
    """Print tables and then lines as they are; without a terminal the tables have so many columns."""
    console = screen(width)
    for table in tables:
        console.print(table, markup=False)
    for line in lines:
        console.print(str(line), markup=False)


class Bar:
    """One bar of a progress display, with the time left; lines in the log where there is no terminal."""

    def __init__(self, progress: Progress, words: str) -> None:
        from gapbeam.studies.engine.workers import TimeLeft

        self._progress, self._task, self._words = progress, progress.add_task(words, total=None, left=""), words
        self._left, self._shown = TimeLeft(), time.monotonic()

    def show(self, done: int, total: int | None, words: str | None = None) -> None:
        """Show the name of the work, and how much of it is done."""
        left = self._left.words(done, total)
        self._words = self._words if words is None else words
        self._progress.update(self._task, completed=done, total=total, description=self._words, left=left)
        if self._progress.disable and time.monotonic() - self._shown > LINE:
            self._shown, whole = time.monotonic(), "" if total is None else f" of {total}"
            LOG.info("%s: %d%s%s", self._words, done, whole, f", {left}" if left else "")


@contextmanager
def progress_bar(words: str) -> Iterator[Bar]:
    """Show a bar on a terminal; elsewhere a line now and then."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    console = Console(stderr=True)
    console.quiet = not console.is_terminal  # else a disabled bar still leaves an empty line
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        yield Bar(progress, words)


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


def shipped_kind(name: str) -> Callable[[], Kind]:
    """Return a function that imports and returns a kind of `study_kinds`."""

    def kind() -> Kind:
        from gapbeam.postprocess.report.folder_report import KINDS

        return KINDS[name]

    return kind


PANEL = "Workers"
CaseArgument = Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")]
Overrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case; may be repeated")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="begin anew")]
WorkerCount = Annotated[
    int | None,
    typer.Option("--workers", min=1, help="processes; by default one a core; 1: this one alone", rich_help_panel=PANEL),
]
SchedulerAddress = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="of a running Dask scheduler", rich_help_panel=PANEL),
]
SlurmOptions = Annotated[
    str | None,
    typer.Option("--slurm", metavar='"OPTIONS"', help="of sbatch, for jobs with workers", rich_help_panel=PANEL),
]


def workers_from(count: int | None, scheduler: str | None, slurm: str | None) -> Workers:
    """Return the workers that options ask for.

    Raises:
        UserError: Options exclude each other, or Dask is not installed.
    """
    from gapbeam.studies.engine.workers import Workers

    return Workers(count, scheduler, slurm)
