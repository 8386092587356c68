"""Paths of results: names that can be written and shown, in a folder that is still there afterwards."""

from __future__ import annotations

import os
import unicodedata
from pathlib import Path

from gapbeam.solver.errors import UserError

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
    """Refuse a folder for results by its name, its place and what is there; changes nothing.

    Args:
        folder: Where results shall go, there or not.

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
        UserError: It is too long, or has characters that no file should have.
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
