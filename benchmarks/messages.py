"""Messages that the ranks of a program send, counted by MPI's profiling interface: `messages.c`, preloaded."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

SOURCE = Path(__file__).with_name("messages.c")
KINDS = ("send", "reduce", "bcast", "gather", "alltoall", "barrier", "wait")
COLLECTIVE = ("reduce", "bcast", "gather", "alltoall", "barrier")


@dataclass
class Sent:
    """Messages, bytes and waiting time of one rank.

    Attributes:
        calls: Calls of MPI by kind: messages, collective operations, waiting for messages.
        bytes: What this rank gave to them, by kind.
        seconds: Wall time in them, by kind, also what others let this rank wait; s.
    """

    calls: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    bytes: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))

    def collective(self, what: str) -> float:
        """Return the calls, bytes or seconds of all collective operations."""
        amounts: dict[str, float] = getattr(self, what)
        return sum(amounts[kind] for kind in COLLECTIVE)

    def minus(self, other: Sent) -> Sent:
        """Return what was sent since another reading."""
        return self.plus(other, -1.0)

    def plus(self, other: Sent, sign: float = 1.0) -> Sent:
        """Return what both have sent."""
        pairs = ((self.calls, other.calls), (self.bytes, other.bytes), (self.seconds, other.seconds))
        return Sent(*({kind: mine[kind] + sign * more[kind] for kind in KINDS} for mine, more in pairs))


def so_far() -> Sent:
    """Return what this rank has sent since it began; for processes started by `on_ranks`.

    Raises:
        AttributeError: Nothing counts in this process.
    """
    read = ctypes.CDLL(None).messages_read
    found: NDArray[np.float64] = np.zeros((3, len(KINDS)))
    read(ctypes.c_void_p(found.ctypes.data))
    return Sent(*(dict(zip(KINDS, map(float, row), strict=True)) for row in found))


def on_ranks(count: int, *command: str, counting: Path | None = None) -> list[str]:
    """Return the words that start Python with arguments on several ranks, each bound to a core where there are enough.

    Args:
        count: Number of ranks.
        command: Arguments of Python.
        counting: What `counter` made, to count what is sent.
    """
    spread = ["--bind-to", "core"] if count <= (os.cpu_count() or 1) else ["--oversubscribe", "--bind-to", "none"]
    preloaded = [] if counting is None else ["-x", f"LD_PRELOAD={counting}"]
    return ["mpirun", *spread, *preloaded, "-n", str(count), sys.executable, "-m", "mpi4py", *command]


@contextmanager
def counter() -> Iterator[Path]:
    """Compile what counts, for as long as the context lasts.

    Raises:
        RuntimeError: The compiler of MPI, mpicc, failed.
    """
    with TemporaryDirectory() as folder:
        target = Path(folder) / "messages.so"
        words = ["mpicc", "-O2", "-shared", "-fPIC", "-o", str(target), str(SOURCE), "-lmpi_mpifh"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(words)} failed:\n{done.stderr[-2000:]}")
        yield target
