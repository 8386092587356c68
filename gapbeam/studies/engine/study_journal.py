"""Journal of a study: its results on disk as they come, from which a killed study resumes."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

from gapbeam.postprocess.results.bounded_files import read_plain
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.run.output.results_folder import finite
from gapbeam.studies.study_folder import study_written

REMEDY = "delete it, and the study begins anew"


class StudyJournal:
    """A file with a line for each result of a study; it goes when the study is complete.

    What follows a line that was cut off is begun anew; see `StudyPlan` for results of other inputs.

    Args:
        path: The file.

    Attributes:
        kept: Results that are there already, by the place of their point.

    Raises:
        NotWritten: The journal cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path, self.kept = path, dict[int, dict[str, Any]]()
        if path.exists():
            with suppress(ResultsError):
                self.kept = _records(
                    read_plain(path, "a file of results", REMEDY).decode("utf-8", "replace").split("\n")[:-1]
                )
        with study_written(path):
            path.write_text("", encoding="utf-8")
        for place, record in self.kept.items():
            self.write(place, record)

    def write(self, place: int, record: dict[str, Any]) -> None:
        """Put a result on disk.

        Raises:
            NotWritten: The disk is full, or the like.
        """
        with study_written(self._path), self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps([place, finite(record)], allow_nan=False) + "\n")

    def close(self) -> None:
        """Take the file away: the study is complete, and its results are in files of their own."""
        self._path.unlink(missing_ok=True)


def _records(lines: list[str]) -> dict[int, dict[str, Any]]:
    """Return the results of whole lines, up to the first invalid one."""
    found: dict[int, dict[str, Any]] = {}
    for line in lines:
        try:
            place, record = json.loads(line)
        except (ValueError, TypeError, RecursionError):
            break
        if not isinstance(place, int) or not isinstance(record, dict):
            break
        found[place] = record
    return found
