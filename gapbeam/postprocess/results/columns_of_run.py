"""The tables of a run beside its history, as columns: contact points, wear, impacts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gapbeam.postprocess.results.face_rows import rows_by_face
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.solver.record_table import (
    IMPACT_COLUMNS,
    IMPACTS_FILE,
    POINT_COLUMNS,
    POINTS_FILE,
    WEAR_COLUMNS,
    WEAR_FILE,
)

HISTORY_TABLE = "history"


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        words: Name, with the labels of its probe, face, load and component: displacement, tip, y.
        unit: SI unit, "1" where there is none.
        values: Numbers or words, (rows,).
    """

    words: tuple[str, ...]
    unit: str
    values: np.ndarray

    @property
    def title(self) -> str:
        """The head of the column: displacement tip y (m)."""
        return " ".join(self.words) + ("" if self.unit == "1" else f" ({self.unit})")

    @property
    def variable(self) -> str:
        """A name that MATLAB takes: displacement_tip_y."""
        return "_".join("".join(sign if sign.isalnum() else "_" for sign in word) for word in self.words)

    @property
    def words_in_it(self) -> bool:
        """Whether its values are words."""
        return bool(self.values.dtype.kind == "U")


@dataclass(frozen=True)
class _Table:
    """A file with rows of numbers by face.

    Attributes:
        file: Its name.
        columns: Behind the face, with their units.
        contents: What it holds, for messages.
        may_lack: How many of the last cells may be empty.
        asked: What makes a run write it.
    """

    file: str
    columns: Mapping[str, str]
    contents: str
    may_lack: int
    asked: str


TABLES = {
    "points": _Table(POINTS_FILE, POINT_COLUMNS, "results of contact points, one a line", 2, "`output.points = true`"),
    "wear": _Table(WEAR_FILE, WEAR_COLUMNS, "work at contact points, one a line", 1, "`[wear]` in the case"),
    "impacts": _Table(IMPACTS_FILE, IMPACT_COLUMNS, "impacts, one a line", 0, "a run in time whose faces meet"),
}


def columns_of_table(folder: Path, name: str) -> list[Column]:
    """Return a table of a run as columns: the face, and what there is behind it; cells of what is not known are NaN.

    Args:
        folder: Of the results.
        name: "points", "wear" or "impacts".

    Raises:
        OptionError: There is no such table, or the run did not write it.
        ResultsError: The file cannot be read.
    """
    if name not in TABLES:
        raise OptionError(f"no table {name!r}; expected one of {HISTORY_TABLE}, {', '.join(TABLES)}")
    table = TABLES[name]
    rows = rows_by_face(folder / table.file, len(table.columns), table.contents, table.may_lack)
    if not rows:
        raise OptionError(f"{folder} has no {table.file} with rows; it takes {table.asked}")
    faces = np.repeat(list(rows), [len(one) for one in rows.values()])
    numbers = np.concatenate(list(rows.values()))
    behind = [
        Column((title,), unit or "1", values)
        for (title, unit), values in zip(table.columns.items(), numbers.T, strict=True)
    ]
    return [Column(("face",), "1", faces), *behind]
