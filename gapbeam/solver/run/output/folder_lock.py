"""Lock of a results folder: one run, or one study, at a time writes it.

The lock is one of the operating system on a file that says who holds it. The former goes with the process that took
it, however that ends; where it does not reach, on another machine, the file alone says so.
"""

from __future__ import annotations

import errno
import fcntl
import json
import logging
import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from gapbeam.solver.errors import UserError
from gapbeam.solver.record_table import LOCK_FILE
from gapbeam.solver.run.output.disk_errors import no_place

if TYPE_CHECKING:
    from mpi4py import MPI

Result = TypeVar("Result")

LOG = logging.getLogger("gapbeam")
UNSUPPORTED = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL}


@contextmanager
def locked(folder: Path, comm: MPI.Comm | None = None) -> Iterator[None]:
    """Hold a results folder, which is made where it is not there.

    Args:
        folder: The results folder.
        comm: The ranks that write it; None: this process alone, without MPI.

    Raises:
        UserError: Another run holds it, or it cannot be made or written.
        NotWritten: The disk has no room.

    Collective.
    """
    held: list[int] = []

    def take() -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            held.append(_taken(folder / LOCK_FILE))
        except OSError as error:
            raise no_place(folder, error) from error

    by_one(comm, take)
    try:
        yield
    finally:
        for place in held:
            with suppress(OSError):
                (folder / LOCK_FILE).unlink()
            os.close(place)


def by_one(comm: MPI.Comm | None, work: Callable[[], Result]) -> Result:
    """Do the work on rank 0, as `on_rank_zero` does, or here where there are no ranks, without MPI. Collective."""
    if comm is None:
        return work()
    from gapbeam.meshes.distribution.rank_zero import on_rank_zero

    return on_rank_zero(comm, work)


def refuse_if_held(folder: Path) -> None:
    """Refuse a folder that another run holds, before anything is computed; changes nothing.

    Raises:
        UserError: Another run holds it.
    """
    with suppress(OSError):
        place = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_NOFOLLOW)
        try:
            _check(place, folder / LOCK_FILE)
        finally:
            os.close(place)


def _taken(path: Path) -> int:
    while True:
        place = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        try:
            left = _check(place, path)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(place), path.stat()):
                    break
        except BaseException:
            os.close(place)
            raise
        os.close(place)  # its holder took it away just now
    if left:
        LOG.info("the run that held %s (process %s) is over; it did not end in order", path.parent, left.get("pid"))
    os.ftruncate(place, 0)
    os.pwrite(place, json.dumps({"host": socket.gethostname(), "pid": os.getpid()}).encode(), 0)
    return place


def _check(place: int, path: Path) -> dict[str, Any]:
    """Take the lock of an open file and return who left it there; refuse one that is held."""
    locks = True
    try:
        fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise _held(path, _holder(place)) from error
    except OSError as error:
        if error.errno not in UNSUPPORTED:
            raise
        locks = False
    left = _holder(place)
    elsewhere = left.get("host") not in (None, socket.gethostname())
    if elsewhere or (not locks and _lives(left.get("pid"))):
        raise _held(path, left)
    return left


def _held(path: Path, holder: dict[str, Any]) -> UserError:
    who = f"process {holder.get('pid', '?')} on {holder.get('host', '?')}"
    return UserError(
        f"{path.parent} is being written by another run ({who}); expected one run at a time; choose another "
        f"`output=`, or delete {path} if that run is over"
    )


def _holder(place: int) -> dict[str, Any]:
    try:
        found = json.loads(os.pread(place, 4096, 0) or b"{}")
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _lives(process: object) -> bool:
    return isinstance(process, int) and Path(f"/proc/{process}").exists()
