"""Check of the output folder: plain files and folders of the run itself, no links that lead elsewhere."""

from __future__ import annotations

import stat
from collections.abc import Iterator
from pathlib import Path

from gapbeam.solver.errors import UserError

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
        files: Where plain files belong, if anything.
        folders: Where folders belong, if anything.

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
