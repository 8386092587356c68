"""Means of signals over blocks of equal length, in constant memory, however long a march is.

A block holds as many records as all others. Where there is no room for another block, neighbors are joined in pairs and
the length doubles. The sums are formed record by record, so that they do not depend on how many records come at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

Array = np.ndarray

MOST = 2048  # blocks; even


class BlockMeans:
    """Means over blocks, and the value at the end of each.

    Args:
        signals: Number of signals.

    Attributes:
        length: Records in a block.
    """

    def __init__(self, signals: int) -> None:
        self.length = 1
        self._signals = signals
        self._sums = np.zeros((MOST, signals))
        self._ends = np.zeros((MOST, signals))
        self._whole = 0
        self._sum, self._waiting = np.zeros(signals), 0

    @property
    def records(self) -> int:
        """Records so far."""
        return self._whole * self.length + self._waiting

    @property
    def means(self) -> Array:
        """Means of the whole blocks, (blocks, signals)."""
        return np.asarray(self._sums[: self._whole] / self.length)

    @property
    def ends(self) -> Array:
        """Values at the ends of the whole blocks, (blocks, signals)."""
        return self._ends[: self._whole].copy()

    def add(self, values: Array) -> None:
        """Take in records, (records, signals)."""
        first = 0
        while first < len(values):
            taken = values[first : first + self.length - self._waiting]
            first += len(taken)
            self._waiting += len(taken)
            self._sum = np.add.accumulate(np.vstack([self._sum, taken]), axis=0)[-1]
            if self._waiting == self.length:
                self._sums[self._whole], self._ends[self._whole] = self._sum, taken[-1]
                self._whole, self._waiting, self._sum = self._whole + 1, 0, np.zeros(self._signals)
                if self._whole == MOST:
                    self._join()

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        return {
            "length": self.length,
            "waiting": self._waiting,
            "sum": self._sum.tolist(),
            "sums": self._sums[: self._whole].tolist(),
            "ends": self._ends[: self._whole].tolist(),
        }

    def restore(self, data: Mapping[str, Any]) -> None:
        """Bring blocks, as they are at a start, to what was stored.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        whole = len(data["sums"])
        length, waiting = int(data["length"]), int(data["waiting"])
        parts = [np.array(data[key], dtype=float).reshape(whole, self._signals) for key in ("sums", "ends")]
        rest = np.array(data["sum"], dtype=float).reshape(self._signals)
        if not (0 <= waiting < length and whole < MOST and all(np.all(np.isfinite(part)) for part in (*parts, rest))):
            raise ValueError(f"{whole} blocks of {length} records and {waiting} more, expected finite means of such")
        self.length, self._waiting, self._whole, self._sum = length, waiting, whole, rest
        self._sums[:whole], self._ends[:whole] = parts

    def _join(self) -> None:
        half = MOST // 2
        self._sums[:half] = self._sums[0::2] + self._sums[1::2]
        self._ends[:half] = self._ends[1::2]
        self._whole, self.length = half, 2 * self.length
