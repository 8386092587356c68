"""How far a run is, from what it leaves in its folder while it goes on; nothing is written, locked or held open."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from gapbeam.postprocess.results.bounded_files import read_plain
from gapbeam.postprocess.results.bounded_json import read_json
from gapbeam.postprocess.results.damaged_files import printable
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.record_table import LOCK_FILE, LOG_FILE, PROGRESS_FILE, SUMMARY_FILE

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
        title: Of the case; "" before it is known.
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
        """Of the run, once it has ended."""
        status = self.summary.get("exit_status")
        return int(status) if self.state == "ended" and isinstance(status, int) else None

    @property
    def errors_pending(self) -> bool:
        """Whether a completed run has no error estimate yet, which may be switched off."""
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
    if holder and (elsewhere or _lives(holder.get("pid"))):
        state = "running" if progress else "starting"
    else:
        state = "gone" if status in (None, "running") else "ended"
    return RunWatch(folder, state, str(summary.get("title") or ""), progress, summary, age, warning, last, elsewhere)


def _refuse_study(folder: Path) -> None:
    """Refuse a folder that has been held for a while without the summary that a run begins with.

    Raises:
        ResultsError: It has.
    """
    with suppress(OSError):
        if time.time() - (folder / LOCK_FILE).stat().st_mtime > BEGUN:
            raise ResultsError(
                folder,
                found="no summary, though something has held the folder for a while: a study",
                expected="the results folder of a run",
                remedy="give the folder of one run; a study shows its progress itself",
            )


def _lives(process: object) -> bool:
    return isinstance(process, int) and os.path.exists(f"/proc/{process}")  # noqa: PTH110 - a Path is no quicker


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
