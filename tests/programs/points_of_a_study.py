"""Points of studies that tests compute: quick ones, and ones that end their worker."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

SLOWLY, HUNGER = 0.05, 0.5  # s


def squared(number: float) -> tuple[float, int]:
    """Return the square of a number, and the process that computed it."""
    return number * number, os.getpid()


def deadly(work: tuple[int, Path, int]) -> int:
    """Kill the process that computes, the first so many times; then return the number of the point.

    Args:
        work: Number of the point, a folder that remembers how often it was tried, and how often it kills.
    """
    number, folder, kills = work
    tried = len(list(folder.glob(f"{number}-*")))
    (folder / f"{number}-{tried}").touch()
    if tried < kills:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(SLOWLY)
    return number


def hungry(size: int) -> int:
    """Take so much memory for a while, bytes, and return the number of the process."""
    taken = bytearray(size)
    taken[::4096] = b"x" * len(taken[::4096])
    time.sleep(HUNGER)
    return os.getpid()


def faulty(_work: object) -> None:
    """Raise an error that says where it was."""
    raise ValueError("a fault of this point")
