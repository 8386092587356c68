"""progress.json: progress of a march, for readers of the results folder while it runs.

It is written beside and renamed, so that a reader sees a whole one; it goes when the march ends. A disk that is full
does not end a run because of it.
"""

from __future__ import annotations

import json
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from gapbeam.solver.diagnostics.energy_gates import describe_energy
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.record_table import PROGRESS_FILE
from gapbeam.solver.run.output.results_folder import finite, write_beside

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
