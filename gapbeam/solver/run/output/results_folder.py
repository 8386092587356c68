"""The results folder: made once, never overwritten by accident."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver import record_table as records
from gapbeam.solver.errors import UserError
from gapbeam.solver.run.output.atomic_files import new_file, part_of
from gapbeam.solver.run.output.disk_errors import no_place
from gapbeam.solver.run.output.folder_lock import refuse_if_held
from gapbeam.solver.run.output.output_file_check import refuse_other_things
from gapbeam.solver.run.output.output_paths import check_place

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


def check_folder(folder: Path, overwrite: bool, replaces: bool = False) -> None:
    """Refuse a results folder that a run could not or should not write; changes nothing.

    Args:
        folder: Where results shall go.
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
        UserError: There is one.
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
    """Remove what runs write into one of the folders in a results folder, and it, if nothing else is in it."""
    for path in list(_within(folder, name)):
        path.unlink()
    with suppress(OSError):
        (folder / name).rmdir()


def _places(folder: Path) -> Iterator[Path]:
    """Yield the files of runs, but for temporary ones, which never are written through."""
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
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value
