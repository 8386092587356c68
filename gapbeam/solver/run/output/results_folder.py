"""The results folder: made once, never overwritten by accident, and locked while a run or a study writes it.

Paths of results have names that can be written and shown. The folder holds plain files and folders of the run itself,
and no links that lead elsewhere.

The operating system locks a file that says who holds the folder, and releases it when that process ends, however it
ends. On another machine, which does not see the lock, the text of the file says so.
"""

from __future__ import annotations

import errno
import fcntl
import json
import math
import os
import socket
import stat
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.meshes.rank_zero import Result
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.run.output.atomic_files import new_file, no_place, part_of
from gapbeam.solver.schema import record_table as records
from gapbeam.solver.schema.record_table import LOCK_FILE, lives

if TYPE_CHECKING:
    from mpi4py import MPI
SHARED = "GAPBEAM_SHARED"
"""Variable with the folders of the machine that the root file system of environment/run shows, separated by colons."""
NO_DISKS = (Path("/proc"), Path("/sys"), Path("/dev"))
BUT = Path("/dev/shm")
LONGEST_NAME = 255  # bytes, of Linux
LONGEST_PATH = 3800  # bytes: of 4096, as files and folders lie below
UNFIT = {"Cc", "Cs", "Zl", "Zp"}
"""Kinds of characters: control, half of a pair (no UTF-8), ends of lines and of paragraphs."""
SHOWN = 40  # letters of a long name
REMEDY = "choose another `output=`"


def check_place(folder: Path) -> None:
    """Refuse a folder for results by its name, place or contents; changes nothing.

    Args:
        folder: Folder for the results, existing or not.

    Raises:
        UserError: Its name is too long, or has characters that no file should have; it lies where nothing stays; it or
            what it lies in is no folder, or cannot be written.
    """
    check_name(folder)
    _check_disk(folder)
    try:
        existing = next(path for path in (folder, *folder.absolute().parents) if os.path.lexists(path))
        if not existing.is_dir():
            kind = "a link that leads nowhere" if existing.is_symlink() and not existing.exists() else "a file"
            raise UserError(f"{existing} is {kind}, not a folder; {REMEDY}")
    except OSError as error:
        raise UserError(f"{folder} cannot be looked at ({error.strerror}); {REMEDY}") from error
    if not os.access(existing, os.W_OK | os.X_OK):
        raise UserError(f"{existing} cannot be written (permission denied or read-only); {REMEDY}")


def check_name(place: Path) -> None:
    """Refuse a file or folder by its name.

    Raises:
        UserError: The name is too long, or has characters that no file should have.
    """
    for part in place.parts:
        found = next((one for one in part if unicodedata.category(one) in UNFIT), None)
        if found is not None:
            raise UserError(
                f'"{_shown(part)}" has a character that no name should have ({found!a}); expected '
                f"letters of UTF-8, without ends of lines and control characters; {REMEDY}"
            )
        _check_length(part, "name", LONGEST_NAME)
    _check_length(str(place.absolute()), "path", LONGEST_PATH)
    if place.parts and place.parts[0] == "~" and not place.exists():
        raise UserError(
            f"{place}: the shell puts a home folder instead of ~ only at the start of a word of its own, without "
            f'quotes; write `output=` "$HOME{str(place)[1:]}"'
        )


def _check_length(text: str, kind: str, most: int) -> None:
    length = len(os.fsencode(text))
    if length > most:
        raise UserError(f'"{_shown(text)}" is a {kind} of {length} bytes; expected at most {most}; {REMEDY}')


def _check_disk(folder: Path) -> None:
    place = Path(os.path.realpath(folder))
    if place == place.parent:
        raise UserError(f"{folder} is the root of all folders; {REMEDY}")
    shared = [Path(path) for path in os.environ.get(SHARED, "").split(":") if path]
    if shared and not any(place.is_relative_to(path) for path in shared):
        raise UserError(
            f"{folder} does not lie on your disk but in the root file system of environment/run, where it would be "
            f"lost at the end of the command; expected a folder in one of {', '.join(map(str, shared))}; {REMEDY}"
        )
    if not shared and any(place.is_relative_to(path) for path in NO_DISKS) and not place.is_relative_to(BUT):
        raise UserError(f"{folder} is no place for files; {REMEDY}")


def _shown(text: str) -> str:
    return ascii(text[:SHOWN])[1:-1] + ("..." if len(text) > SHOWN else "")


KINDS = {
    stat.S_IFLNK: "a link",
    stat.S_IFDIR: "a folder",
    stat.S_IFREG: "a file",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def refuse_other_things(folder: Path, files: Iterator[Path], folders: Iterator[Path]) -> None:
    """Refuse links, pipes, devices and the like where files of a run belong; changes nothing.

    A results folder that came from elsewhere would otherwise decide where we write, or let us wait without end.

    Args:
        folder: The results folder, for the message; it may be a link itself.
        files: Paths of the plain files, if any.
        folders: Paths of the folders, if any.

    Raises:
        UserError: Something else is there; all such places are reported.
    """
    faults = [
        f"{path}: found {found}, expected {expected}"
        for paths, expected in ((files, KINDS[stat.S_IFREG]), (folders, KINDS[stat.S_IFDIR]))
        for path in paths
        if (found := _kind(path)) not in (None, expected)
    ]
    if faults:
        raise UserError("\n  ".join(["what is in the results folder was not written by a run:", *faults[:10]])
                        + f"\ntake it away from {folder}, or choose another `output=`")  # fmt: skip


def _kind(path: Path) -> str | None:
    """Return the kind of file at a path, in words, links not followed; None where nothing is."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return None
    return KINDS.get(stat.S_IFMT(mode), "something else")


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
    from gapbeam.meshes.rank_zero import on_rank_zero

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
    if elsewhere or (not locks and lives(left.get("pid"))):
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


FILES = (
    records.CASE_FILE,
    records.HISTORY_FILE,
    records.FIELDS_FILE,
    records.FIELDS_DATA_FILE,
    records.SUMMARY_FILE,
    records.LOG_FILE,
    records.PROGRESS_FILE,
    records.CURVE_FILE,
    records.CURVE_TABLE_FILE,
    records.IMPACTS_FILE,
    records.SHAPES_FILE,
    records.SHAPES_FIELDS_FILE,
    records.SHAPES_DATA_FILE,
    records.WEAR_FILE,
    records.POINTS_FILE,
)
FOLDERS = {
    records.FIELD_FOLDER: ("[0-9]*.h5", "[0-9]*.part"),
    records.HISTORY_FOLDER: ("[0-9]*.h5", "[0-9]*.h5.part"),
    records.CHECKPOINT_FOLDER: (
        records.CHECKPOINTS,
        f"{records.CHECKPOINTS}.part",
        records.KEPT_MODEL,
        f"{records.KEPT_MODEL}.part",
    ),
}


AS_RUN = "# As it was run"  # how the case that a run leaves begins


def write_case(folder: Path, text: str, summary: dict[str, Any]) -> None:
    """Write the case of a run, with what made it, and its first summary.

    Args:
        folder: Folder of the run.
        text: The case with every default; empty: the run has none.
        summary: The summary.
    """
    if text:
        made = ", ".join(f"{name} {version}" for name, version in summary["versions"].items())
        write_beside(folder / records.CASE_FILE, f"{AS_RUN}, with every default, by {made}.\n{text}")
    write_summary(folder, summary)


def check_folder(folder: Path, overwrite: bool, replaces: bool = False) -> None:
    """Refuse a results folder that a run could not or should not write; changes nothing.

    Args:
        folder: Folder for the results.
        overwrite: Whether the files of an earlier run may be there.
        replaces: Whether they will be removed, its case among them.

    Raises:
        UserError: The folder holds results, or links, pipes or the like in their place, or a case of its author,
            is no place for them (`check_place`), or another run writes it.
    """
    check_place(folder)
    refuse_other_things(folder, _places(folder), (folder / name for name in FOLDERS))
    refuse_if_held(folder)
    if replaces:
        _refuse_to_replace_a_case(folder)
    present = [name for name in FILES if (folder / name).exists()]
    present += [name for name in FOLDERS if any(_within(folder, name))]
    if present and not overwrite:
        resumes = ", or `resume=True` to go on with them" if records.CHECKPOINT_FOLDER in present else ""
        raise UserError(
            f"{folder} already holds results ({', '.join(present)}); "
            f"choose another `output=`, or pass `overwrite=True` to replace them{resumes}"
        )


def _refuse_to_replace_a_case(folder: Path) -> None:
    """Refuse to overwrite a case file that no run has left: `gapbeam run case.toml --output . --overwrite`.

    Raises:
        UserError: The folder has such a case file.
    """
    path = folder / records.CASE_FILE
    with suppress(OSError):
        with path.open("rb") as file:
            begins = file.read(len(AS_RUN))
        if begins and begins != AS_RUN.encode():
            raise UserError(
                f"{path} was not written by a run, and `overwrite=True` would replace it; choose another `output=`, or "
                "give that file another name"
            )


def prepare_folder(folder: Path) -> None:
    """Make a checked folder, and remove the files of an earlier run from it, and only those.

    Raises:
        UserError: The folder cannot be made or written.
        NotWritten: The disk has no room.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            (folder / name).unlink(missing_ok=True)
            (folder / (name + ".part")).unlink(missing_ok=True)
        for name in FOLDERS:
            clear(folder, name)
        probe = folder / ".write-test"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise no_place(folder, error) from error


def clear(folder: Path, name: str) -> None:
    """Remove files of runs from one of the folders in a results folder, and the folder if it is then empty."""
    for path in list(_within(folder, name)):
        path.unlink()
    with suppress(OSError):
        (folder / name).rmdir()


def _places(folder: Path) -> Iterator[Path]:
    """Yield the files of runs, except for temporary ones, which never are written through."""
    yield from (folder / name for name in (*FILES, records.LOCK_FILE))
    for name in FOLDERS:
        if not (folder / name).is_symlink():
            yield from (path for path in _within(folder, name) if path.suffix != ".part")


def _within(folder: Path, name: str) -> Iterator[Path]:
    for pattern in FOLDERS[name]:
        yield from (folder / name).glob(pattern)


def write_beside(path: Path, text: str) -> None:
    """Write a text file so that a reader sees the old one or the new one, never a part."""
    part = part_of(path)
    with os.fdopen(new_file(part), "w", encoding="utf-8") as file:
        file.write(text)
    part.replace(path)


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Write summary.json; numbers that are not finite become null."""
    text = json.dumps(finite(summary | {"format": records.FORMAT_VERSION}), indent=2, allow_nan=False)
    write_beside(folder / records.SUMMARY_FILE, text + "\n")


def finite(value: Any) -> Any:
    """Return a value as JSON can hold it: numbers that are not finite are null."""
    if isinstance(value, dict):
        return {key: finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [finite(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):  # of any kind, as arguments of users are
        return finite(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
