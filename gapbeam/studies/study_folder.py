"""The folder that a study writes: a fit place, held by one process from before the first computation to the end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from gapbeam.solver.errors import NotWritten
from gapbeam.solver.run.output.folder_lock import by_one, locked
from gapbeam.solver.run.output.output_paths import check_place
from gapbeam.studies.stored_records import refuse_links

if TYPE_CHECKING:
    from mpi4py import MPI


@contextmanager
def study_folder(folder: Path, comm: MPI.Comm | None = None) -> Iterator[None]:
    """Hold the folder of a study, which is made; it goes again where nothing was written into it.

    Args:
        folder: Where the study goes.
        comm: The ranks that share the work; None: this process alone, without MPI.

    Raises:
        UserError: Nothing should be written there, it holds links, or another run or study writes it.

    Collective.
    """

    def looked_at() -> list[Path]:
        check_place(folder)
        refuse_links(folder)
        return [path for path in (folder, *folder.absolute().parents) if not path.exists()]

    made = by_one(comm, looked_at)
    try:
        with locked(folder, comm):
            yield
    finally:
        with suppress(OSError):
            for path in made:
                path.rmdir()


@contextmanager
def study_written(path: Path) -> Iterator[None]:
    """Turn what goes wrong while a study writes a file into an error that names the file and what to try.

    Raises:
        NotWritten: By the operating system.
    """
    try:
        yield
    except OSError as error:
        raise NotWritten(
            f"{path} could not be written: {error.strerror or error}; look for a full disk, a quota, or a folder that "
            "was moved or made read-only, then call the study again: it goes on"
        ) from error
