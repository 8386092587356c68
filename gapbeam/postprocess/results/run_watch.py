"""Progress of a run from its results folder, its motion, and spans of its time.

Nothing is written, locked or held open while the run continues. The records of one period of a periodic response are
repeated as often as needed.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.bounded_files import printable, read_json, read_plain
from gapbeam.postprocess.results.columns_of_run import chosen_records, impacts_of
from gapbeam.postprocess.results.results import Results, open_results
from gapbeam.postprocess.results_errors import OptionError, ResultsError
from gapbeam.postprocess.signals.cycle_counts import in_span
from gapbeam.solver.schema.record_table import HISTORY, LOCK_FILE, LOG_FILE, PROGRESS_FILE, SUMMARY_FILE, lives

TAIL = 65536  # bytes of the log that are looked at
BEGUN = 20.0  # s after which a run that holds its folder has a summary
SILENT = 120.0  # s without progress after which a run on another machine is doubted

State = Literal["starting", "running", "ended", "gone"]


@dataclass(frozen=True)
class RunWatch:
    """A run at one moment.

    Attributes:
        folder: Its results folder.
        state: Whether its process sets it up or marches it, it has ended, or its process is gone before it has ended.
        title: Title of the case; "" before it is known.
        progress: `progress.json`; empty before and after the march.
        summary: `summary.json`; empty while there is none.
        age: Since `progress` was written, s; None without one.
        warning: The last warning or error in the log; "" for none.
        last: The last line of the log; "" for none.
        elsewhere: Name of the other machine that the run is on; "" for this one.
    """

    folder: Path
    state: State
    title: str
    progress: Mapping[str, Any]
    summary: Mapping[str, Any]
    age: float | None
    warning: str
    last: str
    elsewhere: str = ""

    @property
    def exit_status(self) -> int | None:
        """Exit status of a run that has ended, else None."""
        status = self.summary.get("exit_status")
        return int(status) if self.state == "ended" and isinstance(status, int) else None

    @property
    def errors_pending(self) -> bool:
        """True for a completed run without an error estimate; estimation may also be switched off."""
        return self.state == "ended" and self.exit_status == 0 and "errors" not in self.summary


def look_at(folder: Path) -> RunWatch:
    """Look at a run.

    The lock of its folder is read and never taken: a run that begins at that moment would be refused.

    Args:
        folder: Its results folder.

    Raises:
        ResultsError: There is no run in it, or its summary cannot be read.
    """
    holder = _json(folder / LOCK_FILE)
    progress = _json(folder / PROGRESS_FILE)
    if not folder.is_dir() or not holder:
        results = open_results(folder)  # or the message that it is none
        summary: Mapping[str, Any] = results.summary
    else:
        summary = _json(folder / SUMMARY_FILE)
        if not summary:
            _refuse_study(folder)
    age = time.time() - float(progress["written"]) if "written" in progress else None
    host = str(holder.get("host", ""))
    elsewhere = host if host not in ("", socket.gethostname()) else ""
    status = summary.get("status")
    warning, last = _log_lines(folder / LOG_FILE)
    state: State
    if holder and (elsewhere or lives(holder.get("pid"))):
        state = "running" if progress else "starting"
    else:
        state = "gone" if status in (None, "running") else "ended"
    return RunWatch(folder, state, str(summary.get("title") or ""), progress, summary, age, warning, last, elsewhere)


def _refuse_study(folder: Path) -> None:
    """Refuse a folder that has been held for a while without the summary that a run begins with.

    Raises:
        ResultsError: The folder has been held for a while without a summary.
    """
    with suppress(OSError):
        if time.time() - (folder / LOCK_FILE).stat().st_mtime > BEGUN:
            raise ResultsError(
                folder,
                found="no summary, though something has held the folder for a while: a study",
                expected="the results folder of a run",
                remedy="give the folder of one run; a study shows its progress itself",
            )


def _json(path: Path) -> dict[str, Any]:
    """Return an object of JSON; empty where there is none, or none yet."""
    with suppress(ResultsError, OSError):
        found = read_json(path, "look again")
        return found if isinstance(found, dict) else {}
    return {}


def _log_lines(path: Path) -> tuple[str, str]:
    """Return the last warning or error of a log and its last line, without their times."""
    with suppress(OSError, ResultsError):
        lines = read_plain(path, "a log", "look again")[-TAIL:].decode("utf-8", errors="replace").splitlines()
        said = [parts for line in lines if len(parts := line.split(" ", 3)) == 4]
        doubts = [words for _, _, level, words in said if level in ("WARNING", "ERROR")]
        return printable(doubts[-1]) if doubts else "", printable(said[-1][3]) if said else ""
    return "", ""


ENOUGH = 16.0  # forcing periods


def is_periodic(results: Results) -> bool:
    """Return whether a run found a periodic response, so that its records are one period of it."""
    return results.status == "completed" and (results.case.get("analysis") or {}).get("type") == "periodic"


def motion_of(results: Results, frequency: float | None) -> xr.Dataset:
    """Return the records of a run; of a computed periodic response as they repeat.

    Args:
        results: Results of any run.
        frequency: Frequency of the forcing, Hz.

    Raises:
        ResultsError: The results cannot be read.
    """
    if frequency is None or not is_periodic(results):
        return results.history
    return repeated(results.history, frequency)


def repeated(history: xr.Dataset, frequency: float) -> xr.Dataset:
    """Return the records of whole cycles, first and last the same state, going on for 16 forcing periods at least.

    Impulse, work and losses since the start go on growing.
    """
    time = np.asarray(history["time"].values, dtype=float)
    span = float(time[-1] - time[0])
    rounds = ceil(ENOUGH / max(span * frequency, 1.0))
    running = {record.name for record in HISTORY if "since t = 0" in record.meaning}
    first = history.isel(time=slice(0, 1))
    parts = []
    for turn in range(rounds):
        part = history.isel(time=slice(1, None))
        part = part.assign_coords(time=time[1:] + turn * span)
        for name in running & set(map(str, part.data_vars)):
            grown = history[name].isel(time=-1, drop=True) - history[name].isel(time=0, drop=True)
            part[name] = part[name] + turn * grown
        parts.append(part)
    return xr.concat([first, *parts], dim="time")


@dataclass(frozen=True)
class SpanOfRun(Results):
    """Records of a run in a span of time; all other results are those of the whole run.

    Attributes:
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.
    """

    begin: float | None = None
    end: float | None = None

    @cached_property
    def whole_history(self) -> xr.Dataset:
        """All records of the run."""
        return open_results(self.folder).history

    @cached_property
    def history(self) -> xr.Dataset:
        """The records in the span."""
        return chosen_records(self.whole_history, (), self.begin, self.end)

    @property
    def times(self) -> tuple[float, float]:
        """Times of the first and the last record, s."""
        return float(self.history["time"][0]), float(self.history["time"][-1])

    @property
    def impacts(self) -> dict[str, np.ndarray]:
        """Impacts that began in the span, by face, as `impacts_of` has them."""
        return in_span(impacts_of(self.folder), *self.times)


def span_of(folder: Path, begin: float | None, end: float | None) -> SpanOfRun:
    """Return a span of a run.

    Args:
        folder: Its results folder.
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.

    Raises:
        ResultsError: The results cannot be read.
        OptionError: A span with fewer than two records, or a run that computed one period of its response.
    """
    found = SpanOfRun(open_results(folder).folder, begin, end)
    if is_periodic(found):
        raise OptionError("the run computed one period of its response: no span of time can be chosen from it")
    if found.history.sizes["time"] < 2:
        raise OptionError(
            f"there is one record only, at {found.times[0]:g} s, in the span of time asked for; expected two at least; "
            "choose a longer span"
        )
    return found
