"""Progress of a run: a bar on a terminal, plain lines elsewhere, progress.json and run.log; rank 0 only.

Readers of the results folder see in progress.json how far a march is.

It is written beside and renamed, so that a reader sees a whole one; it goes when the march ends. A disk that is full
does not end a run because of it.

run.log has the lines of the terminal and the details that analysts want (level DEBUG), with times.
"""

from __future__ import annotations

import json
import logging
import math
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from gapbeam.solver.diagnostics.energy_gates import describe_energy
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.run.output.results_folder import finite, write_beside
from gapbeam.solver.schema.record_table import LOG_FILE, PROGRESS_FILE

if TYPE_CHECKING:
    from mpi4py import MPI
    from rich.progress import Progress
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
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

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
        text = f"{self._place(now)}, {_digits(self._steps / (clock - self._started), 2, 0)} steps/s, {contact}"
        if self._bar is not None:
            self._bar.update(self._task, completed=now, description=text)
        else:
            left = (clock - self._started) * max(self._end - now, 0.0) / max(now - self._begin, 1e-300)
            LOG.info("%s, %.0f s left", text, left)

    def _place(self, now: float) -> str:
        if self._period is None:
            unit, factor = next((name, factor) for name, factor, least in CLOCKS if self._end >= least)
            end = factor * self._end
            return f"t = {_digits(factor * now, 5, 0, end)} of {end:g} {unit}"
        periods = self._end / self._period
        return f"period {_digits(now / self._period, 3, 1, periods)} of {_digits(periods, 3, 1)}"


def _digits(value: float, count: int, least: int, whole: float | None = None) -> str:
    """Return a number with the decimals by which the whole, or itself, has so many digits, and at least some."""
    size = value if whole is None else whole
    return f"{value:.{max(least, count - 1 - math.floor(math.log10(size)))}f}"


# unit of times, their number in a second, and the least end of a run that has it, s
CLOCKS = (("s", 1.0, 1.0e-3), ("us", 1.0e6, 1.0e-6), ("ns", 1.0e9, 0.0))

INTERVAL = 2.0  # s of wall time between two of them


class ProgressFile:
    """Writes how far a march is, at most every two seconds; rank 0 only.

    Args:
        folder: Results folder.
        end: End of the run, s.
        quiet: Write nothing (other ranks).

    Speed and time left are those since the first report: what comes before it holds the compilation of the loop.
    """

    def __init__(self, folder: Path, end: float, quiet: bool) -> None:
        self._path, self._end, self._quiet = folder / PROGRESS_FILE, end, quiet
        self._first: tuple[float, float] | None = None  # wall time and time of the first report
        self._written = -INTERVAL
        self._steps = 0

    def report(self, accounts: Accounts, steps: int, closed: list[str]) -> None:
        """Report that some more steps are done, and which faces are closed."""
        if self._quiet:
            return
        clock = time.perf_counter()
        if self._first is None:
            self._first = clock, accounts.time
        else:
            self._steps += steps
        if clock - self._written < INTERVAL:
            return
        self._written = clock
        with suppress(OSError):
            write_beside(self._path, json.dumps(finite(self._facts(accounts, clock, closed))) + "\n")

    def remove(self) -> None:
        """Take the file away."""
        if not self._quiet:
            with suppress(OSError):
                self._path.unlink(missing_ok=True)

    def _facts(self, accounts: Accounts, clock: float, closed: list[str]) -> dict[str, Any]:
        assert self._first is not None
        seconds, marched = clock - self._first[0], accounts.time - self._first[1]
        faces, peaks, touched = accounts.system.contact.face_names, accounts.peaks, accounts.times.time
        return {
            "written": time.time(),
            "time": accounts.time,
            "end": self._end,
            "seconds_left": seconds * (self._end - accounts.time) / marched if marched > 0.0 else None,
            "steps_per_second": self._steps / seconds if self._steps else None,
            "steps": accounts.tally.steps,
            "closed": closed,
            "contact_share": {
                name: float(one) / accounts.time if accounts.time > 0.0 else None
                for name, one in zip(faces, touched, strict=True)
            },
            "peak_contact_force": dict(zip(faces, map(float, peaks.force), strict=True)),
            "largest_penetration": float(max(peaks.deepest)),
            "energy": describe_energy(accounts.ledger, accounts.gates),
        }


class _Quiet(logging.FileHandler):
    """A log that a full disk does not stop; the terminal shows everything anyway."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the name that logging calls
        """Leave the line out."""


class _Kept(logging.Handler):
    """Lines that come before there is a folder."""

    def __init__(self) -> None:
        super().__init__()
        self.records: list[logging.LogRecord] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a line."""
        self.records.append(record)


@contextmanager
def kept_lines() -> Iterator[list[logging.LogRecord]]:
    """Keep log lines that come before there is a folder, for `log_file`."""
    kept = _Kept()
    LOG.addHandler(kept)
    try:
        yield kept.records
    finally:
        LOG.removeHandler(kept)


@contextmanager
def log_file(folder: Path, comm: MPI.Comm | None = None, earlier: Iterable[logging.LogRecord] = ()) -> Iterator[None]:
    """Send the log of rank 0, or of a process without MPI, to run.log as well, earlier lines first; not collective."""
    if comm is not None and comm.rank != 0:
        yield
        return
    handler = _Quiet(folder / LOG_FILE, delay=True, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    for record in earlier:
        handler.handle(record)
    LOG.addHandler(handler)
    try:
        yield
    finally:
        LOG.removeHandler(handler)
        handler.close()
