"""Progress of a run: a bar on a terminal, plain lines elsewhere; rank 0 only."""

from __future__ import annotations

import logging
import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

LOG = logging.getLogger("gapbeam")
REDRAW = 0.1  # s
LINE = 10.0  # s between plain lines


class ProgressLine:
    """Shows how far a march is.

    Args:
        end: End of the run, s.
        period: Forcing period, s, or None.
        quiet: Show nothing (other ranks).
        begin: Time that the march continues from, s.

    Speed and time left are those after the first report: what comes before it holds the compilation of the loop.
    """

    def __init__(self, end: float, period: float | None, quiet: bool, begin: float = 0.0) -> None:
        self._end, self._period, self._quiet, self._begin = end, period, quiet, begin
        self._started = self._shown = time.perf_counter()
        self._steps: int | None = None
        self._bar: Progress | None = None

    def __enter__(self) -> ProgressLine:
        """Start the bar, if there is a terminal to draw on."""
        if not self._quiet and sys.stderr.isatty():
            columns = (BarColumn(), TextColumn("{task.description}"), TimeRemainingColumn())
            self._bar = Progress(*columns, console=Console(stderr=True), transient=True)
            self._bar.start()
            self._task = self._bar.add_task("", total=self._end)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()

    def advance(self, now: float, steps: int, contact: str) -> None:
        """Report that some steps ending at `now` are done, with the state of contact in words."""
        if self._quiet:
            return
        clock = time.perf_counter()
        if self._steps is None:
            self._steps, self._begin, self._started = 0, now, clock
            return
        self._steps += steps
        if clock - self._shown < (REDRAW if self._bar is not None else LINE):
            return
        self._shown = clock
        text = f"{self._place(now)}, {self._steps / (clock - self._started):.0f} steps/s, {contact}"
        if self._bar is not None:
            self._bar.update(self._task, completed=now, description=text)
        else:
            left = (clock - self._started) * (self._end - now) / max(now - self._begin, 1e-300)
            LOG.info("%s, %.0f s left", text, left)

    def _place(self, now: float) -> str:
        if self._period is None:
            return f"t = {now:.4f} of {self._end:g} s"
        return f"period {now / self._period:.1f} of {self._end / self._period:.1f}"
