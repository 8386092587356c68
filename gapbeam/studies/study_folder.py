"""Folder that a study writes: a fit place, locked by one process from before the first computation to the end.

A study is resumed from its records on disk, which are checked first.
"""

from __future__ import annotations

import csv
import io
import json
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.case.reading.value_words import flat
from gapbeam.solver.messages.errors import NotWritten, UserError
from gapbeam.solver.messages.wording import printable
from gapbeam.solver.run.output.results_folder import by_one, check_place, finite, locked, write_beside
from gapbeam.solver.schema.table import Number, Whole

if TYPE_CHECKING:
    from mpi4py import MPI
_Text = Annotated[str, Strict()]
PLAN_FILE = "plan.json"
REMEDY = "choose another `output=`, or pass `overwrite=True` to begin anew"


class _Stored(BaseModel):
    """A table that may hold further keys."""

    model_config = ConfigDict(extra="allow")


class StoredFigure(_Stored):
    """A figure with its scatter."""

    unit: _Text
    mean: Number
    scatter: Number
    mean_in_g: Number | None = None
    error: Number | None = None


class StoredResponse(_Stored):
    """A response of a sweep."""

    values: dict[_Text, _Text]
    direction: _Text
    start: _Text
    verdict: _Text
    exit_status: Whole = Field(ge=0, le=255)
    message: _Text
    notes: list[_Text]
    response: _Text | None = None
    figures: dict[_Text, StoredFigure] = {}
    seconds: dict[_Text, Number] = {}


class StoredPiece(_Stored):
    """An experiment of an identification with one set of values."""

    values: list[Number]
    experiment: Whole = Field(ge=0)
    start: Whole = Field(ge=0)
    verdict: _Text
    response: _Text
    exit_status: Whole = Field(ge=0, le=255)
    message: _Text
    figures: dict[_Text, StoredFigure] = {}


Kind = TypeVar("Kind", bound=_Stored)


def checked(found: Any, kind: type[Kind], path: Path, remedy: str = REMEDY) -> dict[str, Any]:
    """Return a record as it was read, after making sure that it is one.

    Args:
        found: Contents of the file.
        kind: Type of record that it must be.
        path: The file, for the message.
        remedy: Advice where it is none.

    Raises:
        ResultsError: Something is missing, or is not what it must be: the first five of all such places.
    """
    try:
        kind.model_validate(found)
    except ValidationError as error:
        faults = error.errors(include_url=False, include_input=False, include_context=False)
        text = [f"{printable('.'.join(map(str, fault['loc'])) or 'the whole')}: {fault['msg']}" for fault in faults]
        raise ResultsError(path, "; ".join(text[:5]), "a record as gapbeam writes it", remedy) from error
    record: dict[str, Any] = found
    return record


def refuse_links(*folders: Path, places: Sequence[Path] = ()) -> None:
    """Refuse to write where links lead out of a folder of ours.

    Args:
        folders: Folders whose entries are about to be written, as far as they exist.
        places: Files and folders that must be no links themselves.

    Raises:
        UserError: An entry of a folder is a link, or one of the places is.
    """
    for place in places:
        if place.is_symlink():
            raise UserError(
                f"{place} is a link; gapbeam does not write through it: remove it, or choose another `output=`"
            )
    for folder in folders:
        links = sorted(entry.name for entry in folder.iterdir() if entry.is_symlink()) if folder.is_dir() else []
        if links:
            text = ", ".join(map(printable, links[:5]))
            raise UserError(
                f"{folder} holds links ({text}); expected plain files and folders, which is what "
                "gapbeam writes there. "
                "Choose another `output=`, or remove the links"
            )


def differing(before: dict[str, Any], now: dict[str, Any], words: Mapping[str, str] | None = None) -> str:
    """Return in words in which keys two plans differ, the first five of them; "" where they are the same.

    Keys of tables in a plan, as the case of a life, count each for itself.

    Args:
        before: One plan.
        now: The other.
        words: Names of keys in messages, where that is not their name.
    """
    words, before, now = words or {}, flat(before), flat(now)
    keys = [key for key in {**before, **now} if before.get(key) != now.get(key)]
    text = "; ".join(
        f"{words.get(key, printable(key))}: {printable(repr(before.get(key)))} there, "
        f"{printable(repr(now.get(key)))} now"
        for key in keys[:5]
    )
    return text + (f" and {len(keys) - 5} more keys" if len(keys) > 5 else "")


@dataclass(frozen=True)
class StudyPlan:
    """Inputs that decide the results of a study, which stand in its folder beside them.

    Attributes:
        inputs: The inputs, by dotted keys or in tables.
        overwrite: Begin anew, whatever the folder holds.
        records: Files and folders of finished parts, by name, which go when the study begins anew.
        words: Names of inputs in messages, where that is not their key.
    """

    inputs: Mapping[str, Any]
    overwrite: bool = False
    records: tuple[str, ...] = ()
    words: Mapping[str, str] = field(default_factory=dict)

    def keep(self, folder: Path) -> str | None:
        """Write the inputs into a folder, unless results of other inputs are there.

        Returns:
            The text that stood there before, maybe none; None: these inputs stood there, and the study resumes.

        Raises:
            UserError: The folder holds a study of other inputs: which differ, and how.
            ResultsError: The inputs there cannot be read.
            NotWritten: The folder cannot be written.
        """
        path, inputs = folder / PLAN_FILE, json.loads(json.dumps(self.inputs, default=str))
        known = path.exists() and not self.overwrite
        if known and (text := differing(read_object(path, remedy=REMEDY), inputs, self.words)):
            raise UserError(f"{folder} holds a study of other inputs: {text}. {REMEDY[0].upper()}{REMEDY[1:]}")
        if known:
            return None
        with study_written(path):
            before = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
            for old in (folder / name for name in self.records):
                shutil.rmtree(old) if old.is_dir() else old.unlink(missing_ok=True)
            write_beside(path, json.dumps(inputs, indent=1) + "\n")
        return before

    def withdraw(self, folder: Path, before: str | None) -> None:
        """Put back what stood in a folder, where a study that began anew failed before its first record."""
        records = [folder / name for name in self.records]
        begun = any(any(one.iterdir()) if one.is_dir() else one.exists() and one.stat().st_size for one in records)
        if before is None or begun:
            return
        with suppress(OSError):
            for one in records:
                one.rmdir() if one.is_dir() else one.unlink(missing_ok=True)
            if before:
                write_beside(folder / PLAN_FILE, before)
            else:
                (folder / PLAN_FILE).unlink()


@contextmanager
def study_folder(folder: Path, comm: MPI.Comm | None = None, plan: StudyPlan | None = None) -> Iterator[None]:
    """Hold the folder of a study, which is made; it goes again where nothing was written into it.

    Args:
        folder: Folder for the study.
        comm: The ranks that share the work; None: this process alone, without MPI.
        plan: Inputs of the study; None: its records know of what they are.

    Raises:
        UserError: Nothing should be written there, it holds links, another run or study writes it, or it holds a study
            of other inputs.
        ResultsError: The inputs of the study there cannot be read.
        NotWritten: The inputs cannot be written.

    Collective.
    """

    def looked_at() -> list[Path]:
        check_place(folder)
        refuse_links(folder)
        return [path for path in (folder, *folder.absolute().parents) if not path.exists()]

    made = by_one(comm, looked_at)
    try:
        with locked(folder, comm):
            before = by_one(comm, lambda: None if plan is None else plan.keep(folder))
            try:
                yield
            except BaseException:
                if plan is not None and (comm is None or comm.rank == 0):
                    plan.withdraw(folder, before)
                raise
    finally:
        with suppress(OSError):
            for path in made:
                path.rmdir()


@contextmanager
def study_written(path: Path) -> Iterator[None]:
    """Turn an error while a study writes a file into one with the file and advice.

    Raises:
        NotWritten: The operating system reports an error.
    """
    try:
        yield
    except OSError as error:
        raise NotWritten(
            f"{path} could not be written: {error.strerror or error}; look for a full disk, a quota, or a folder that "
            "was moved or made read-only, then call the study again: it resumes"
        ) from error


def write_json(path: Path, data: Any) -> None:
    """Write data of a study as JSON, what is not finite as null.

    Raises:
        NotWritten: The operating system reports an error.
    """
    with study_written(path):
        write_beside(path, json.dumps(finite(data), indent=1, allow_nan=False) + "\n")


def write_table(path: Path, heads: Iterable[Any], rows: Iterable[Iterable[Any]]) -> None:
    """Write a table of a study as CSV, in a folder that is made where it is missing.

    Raises:
        NotWritten: The operating system reports an error.
    """
    text = io.StringIO()
    csv.writer(text).writerows([heads, *rows])
    with study_written(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_beside(path, text.getvalue())
