"""What commands write on a terminal: tables as wide as they need, and a progress bar that goes when it is done."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress


def screen(width: int) -> Console:
    """Return where tables go; where there is no terminal to fit them to they have so many columns."""
    console = Console(soft_wrap=True, highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, width)
    return console


class Bar:
    """One bar of a progress display."""

    def __init__(self, progress: Progress, words: str) -> None:
        self._progress, self._task = progress, progress.add_task(words, total=None)

    def show(self, done: int, total: int | None, words: str | None = None) -> None:
        """Show how much is done of how much, and of what."""
        self._progress.update(self._task, completed=done, total=total)
        if words is not None:
            self._progress.update(self._task, description=words)


@contextmanager
def progress_bar(words: str) -> Iterator[Bar]:
    """Show a bar on a terminal; elsewhere nothing."""
    console = Console(stderr=True)
    console.quiet = not console.is_terminal  # else a disabled bar still leaves an empty line
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        yield Bar(progress, words)
