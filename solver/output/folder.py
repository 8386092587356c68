"""The results folder: made once, never overwritten by accident."""

from __future__ import annotations

from pathlib import Path

from solver.errors import UserError
from solver.output import records

FILES = (
    records.CASE_FILE,
    records.HISTORY_FILE,
    records.FIELDS_FILE,
    records.FIELDS_DATA_FILE,
    records.SUMMARY_FILE,
    records.LOG_FILE,
)


def prepare_folder(folder: Path, overwrite: bool) -> None:
    """Make a results folder ready to be written by rank 0.

    Args:
        folder: Where results go.
        overwrite: Remove the files of an earlier run, and only those.

    Raises:
        UserError: The folder holds results, is no folder, or cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise UserError(f"{folder} is a file, not a results folder; choose another --output") from error
    except OSError as error:
        raise UserError(f"{folder} cannot be made ({error.strerror}); choose another --output") from error
    present = [name for name in FILES if (folder / name).exists()]
    if present and not overwrite:
        raise UserError(
            f"{folder} already holds results ({', '.join(present)}); "
            "choose another --output, or pass --overwrite to replace them"
        )
    try:
        for name in present:
            (folder / name).unlink()
        probe = folder / ".write-test"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise UserError(f"{folder} cannot be written ({error.strerror}); choose another --output") from error


def write_beside(path: Path, text: str) -> None:
    """Write a text file so that a reader sees the old one or the new one, never a part."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)
