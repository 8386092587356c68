"""The impacts of a face: time, approach speed, impulse and duration of each, in bounded memory.

Where there is no room for another impact, every second one goes, and from then on every second one is kept: what is
kept stays spread evenly over all impacts, so that its distribution is theirs. Which ones are kept follows from their
order alone. The parting before each impact, from the end of the impact before, is kept with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gapbeam.solver.record_table import IMPACT_COLUMNS

Array = np.ndarray

MOST = 4096  # impacts that are kept of a face
COLUMNS = tuple(IMPACT_COLUMNS)[:-1]  # how many one stands for is counted at the end
TIME, DURATION = COLUMNS.index("time"), COLUMNS.index("duration")


class ImpactList:
    """Impacts in the order in which they ended.

    Attributes:
        count: Their number.
        every: Every so many of them is kept: 1, 2, 4, ...
    """

    def __init__(self) -> None:
        self.count, self.every = 0, 1
        self._kept: Array = np.zeros((0, len(COLUMNS) + 1))  # the impacts, and the parting before each
        self._new: list[Array] = []
        self._room = MOST
        self._end = -np.inf

    @property
    def rows(self) -> Array:
        """The impacts that are kept: closing time, s, approach speed, m/s, impulse, N s, duration, s; (k, 4)."""
        return self._all()[:, :-1]

    @property
    def partings(self) -> Array:
        """Time that the face was open before each stored impact, (k,), s; infinite before the first."""
        return self._all()[:, -1]

    def add(self, rows: Array) -> None:
        """Take in impacts, (n, 4), in the order in which they ended."""
        if not len(rows):
            return
        ends = rows[:, TIME] + rows[:, DURATION]
        partings = rows[:, TIME] - np.append(self._end, ends[:-1])
        taken = np.arange(self.count, self.count + len(rows)) % self.every == 0
        self.count, self._end = self.count + len(rows), float(ends[-1])
        self._new.append(np.column_stack([rows, partings])[taken])
        self._room -= len(self._new[-1])
        while self._room < 0:
            self.every *= 2
            self._kept = self._all()[::2]
            self._room = MOST - len(self._kept)

    def _all(self) -> Array:
        if self._new:
            self._kept = np.concatenate([self._kept, *self._new])
            self._new.clear()
        return self._kept

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON; what is infinite, before the first impact, is null."""
        rows = [[x if np.isfinite(x) else None for x in row] for row in self._all().tolist()]
        return {"count": self.count, "every": self.every, "rows": rows, "end": self._end if self.count else None}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Bring a list, as it is at a start, to what was stored.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        rows = np.array([[*row[:-1], np.inf if row[-1] is None else row[-1]] for row in data["rows"]], dtype=float)
        rows = rows.reshape(-1, len(COLUMNS) + 1)
        count, every = int(data["count"]), int(data["every"])
        end = -np.inf if data["end"] is None else float(data["end"])
        whole = np.all(np.isfinite(rows[:, :-1])) and not np.any(np.isnan(rows)) and np.isfinite(end) == (count > 0)
        if every < 1 or len(rows) != -(-count // every) or len(rows) > MOST or not whole:
            raise ValueError(f"{len(rows)} of {count} impacts, each {every}th kept; expected finite numbers of such")
        self.count, self.every, self._end = count, every, end
        self._kept, self._new, self._room = rows, [], MOST - len(rows)
