"""run.log: what was printed on the terminal, with times."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from gapbeam.solver.record_table import LOG_FILE

if TYPE_CHECKING:
    from mpi4py import MPI

LOG = logging.getLogger("gapbeam")


class _Quiet(logging.FileHandler):
    """A log that a full disk does not stop; the terminal shows everything anyway."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the name that logging calls
        """Leave the line out."""


@contextmanager
def log_file(folder: Path, comm: MPI.Comm | None = None) -> Iterator[None]:
    """Send the log of rank 0, or of a process without MPI, to run.log as well; not collective."""
    if comm is not None and comm.rank != 0:
        yield
        return
    handler = _Quiet(folder / LOG_FILE, delay=True, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    LOG.addHandler(handler)
    try:
        yield
    finally:
        LOG.removeHandler(handler)
        handler.close()
