"""The impacts of a face: time, approach speed, impulse and duration of each, in bounded memory.

Where there is no room for another impact, every second one goes, and from then on every second one is kept: what is
kept stays spread evenly over all impacts, so that its distribution is theirs. Which ones are kept follows from their
order alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gapbeam.solver.record_table import IMPACT_COLUMNS

Array = np.ndarray

MOST = 4096  # impacts that are kept of a face
COLUMNS = tuple(IMPACT_COLUMNS)[:-1]  # how many one stands for is counted at the end


class ImpactList:
    """Impacts in the order in which they ended.

    Attributes:
        count: How many there were.
        every: Every so many of them is kept: 1, 2, 4, ...
    """

    def __init__(self) -> None:
        self.count, self.every = 0, 1
        self._rows: list[Array] = []
        self._kept = 0

    @property
    def rows(self) -> Array:
        """The impacts that are kept: closing time, s, approach speed, m/s, impulse, N s, duration, s; (k, 4)."""
        return np.concatenate([np.zeros((0, len(COLUMNS))), *self._rows])

    def add(self, rows: Array) -> None:
        """Take in impacts, (n, 4), in the order in which they ended."""
        numbers = np.arange(self.count, self.count + len(rows))
        taken = rows[numbers % self.every == 0]
        self.count += len(rows)
        self._kept += len(taken)
        self._rows.append(np.array(taken, dtype=float))
        while self._kept > MOST:
            self.every *= 2
            self._rows = [self.rows[::2]]
            self._kept = len(self._rows[0])

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        return {"count": self.count, "every": self.every, "rows": self.rows.tolist()}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Bring a list, as it is at a start, to what was stored.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        rows = np.array(data["rows"], dtype=float).reshape(-1, len(COLUMNS))
        count, every = int(data["count"]), int(data["every"])
        if every < 1 or len(rows) != -(-count // every) or len(rows) > MOST or not np.all(np.isfinite(rows)):
            raise ValueError(f"{len(rows)} of {count} impacts, each {every}th kept; expected finite numbers of such")
        self.count, self.every, self._rows, self._kept = count, every, [rows], len(rows)
