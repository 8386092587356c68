"""Means over blocks of signals that are recorded as sums over time: the sums at the ends of blocks say all.

As `block_means`, but a record costs next to nothing: only the sums at the ends of blocks are kept, and where there is
no room for another block, every second end goes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

Array = np.ndarray


class BlockEnds:
    """Sums at the ends of blocks of equal length.

    Args:
        signals: Number of signals.
        most: Number of blocks for which there is room; even.

    Attributes:
        length: Records in a block.
    """

    def __init__(self, signals: int, most: int) -> None:
        self.length = 1
        self._signals, self._most = signals, most
        self._ends = np.zeros((most + 1, signals))  # the first one is that before all blocks
        self._whole, self._waiting = 0, 0

    @property
    def changes(self) -> Array:
        """Change of the sums over a record, mean over each whole block, (blocks, signals)."""
        return np.asarray(np.diff(self._ends[: self._whole + 1], axis=0) / self.length)

    def begin(self, sums: Array) -> None:
        """Take in the sums before the first block, (signals,)."""
        self._ends[0] = sums

    def add(self, sums: Array) -> None:
        """Take in records of the sums, (records, signals)."""
        first = 0
        while True:
            missing = self.length - self._waiting
            blocks = max(0, (len(sums) - first - missing) // self.length + 1)
            taken = min(blocks, self._most - self._whole)
            if taken == 0:
                self._waiting += len(sums) - first
                return
            ends = first + missing - 1 + self.length * np.arange(taken)
            self._ends[self._whole + 1 : self._whole + 1 + taken] = sums[ends]
            self._whole, self._waiting, first = self._whole + taken, 0, int(ends[-1]) + 1
            if self._whole == self._most:
                half = self._most // 2
                self._ends[: half + 1] = self._ends[0::2]
                self._whole, self.length = half, 2 * self.length

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        return {"length": self.length, "waiting": self._waiting, "ends": self._ends[: self._whole + 1].tolist()}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Bring blocks, as they are at a start, to what was stored.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        whole, length, waiting = len(data["ends"]) - 1, int(data["length"]), int(data["waiting"])
        ends = np.array(data["ends"], dtype=float).reshape(whole + 1, self._signals)
        if not (0 <= waiting < length and 0 <= whole < self._most and np.all(np.isfinite(ends))):
            raise ValueError(f"{whole} blocks of {length} records and {waiting} more, expected finite sums of such")
        self.length, self._waiting, self._whole = length, waiting, whole
        self._ends[: whole + 1] = ends
