"""fields.xdmf during a run: a document that grows in place and is whole at any moment.

What comes behind the end of an XML document may be a processing instruction, whose text is not looked at:

    HEAD grid ... grid TAIL<?room                                     ?>

A further grid is written into that room first, with another `TAIL<?room ` behind it. Then the first `TAIL<?room `,
which lies within one sector, is overwritten with blanks. A process that is killed in between leaves the document as it
was. Where there is no room left, the document is written anew beside itself with room for as much again.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from gapbeam.solver.run.output.results_folder import write_beside

HEAD = (
    '<?xml version="1.0" encoding="utf-8"?>\n'
    '<Xdmf Version="3.0"><Domain><Grid Name="gapbeam" GridType="Collection" CollectionType="Temporal">'
)
TAIL = "</Grid></Domain></Xdmf>"
SWITCH = f"{TAIL}<?room "
END = "?>\n"
ROOM = 2**16  # bytes, at least
SECTOR = 512


class GrowingSeries:
    """An XDMF file to which grids are added.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._switch = self._end = 0  # where SWITCH and END are, bytes

    def write(self, grids: Sequence[str]) -> None:
        """Write the document anew, with room behind it.

        Raises:
            OSError: It could not be written; the one before it is as it was.
        """
        body = HEAD + "".join(grids)
        self._switch = _within_a_sector(len(body.encode()))
        body += " " * (self._switch - len(body.encode())) + SWITCH
        room = " " * max(ROOM, len(body))
        write_beside(self._path, body + room + END)
        self._end = len(body.encode()) + len(room)

    def add(self, grids: Sequence[str], count: int = 1) -> None:
        """Add the last ones of all grids.

        Args:
            grids: All.
            count: Number of new ones.

        Raises:
            OSError: It could not be written; the document is as it was.
        """
        begin, grid = self._switch + len(SWITCH), "".join(grids[-count:]).encode()
        switch = _within_a_sector(begin + len(grid))
        if switch + len(SWITCH) > self._end:
            self.write(grids)
            return
        text = grid.ljust(switch - begin) + SWITCH.encode()
        place = os.open(self._path, os.O_WRONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
        try:
            for at, part in ((begin, text), (self._switch, b" " * len(SWITCH))):
                if os.pwrite(place, part, at) < len(part):
                    raise OSError("no room on the disk")
        finally:
            os.close(place)
        self._switch = switch

    def finish(self, grids: Sequence[str]) -> None:
        """Write the document as it stays.

        Raises:
            OSError: It could not be written; the one before it is as it was.
        """
        write_beside(self._path, f"{HEAD}{''.join(grids)}{TAIL}\n")


def _within_a_sector(place: int) -> int:
    """Return the first place from one on where SWITCH lies in one sector of the disk."""
    return place if place % SECTOR + len(SWITCH) <= SECTOR else -(-place // SECTOR) * SECTOR
