"""Checkpoint files: a line with sizes and checksum, then JSON and arrays.

    gapbeam-checkpoint VERSION SHA256 BYTES-OF-JSON BYTES-OF-ARRAYS

The arrays are a numpy .npz without pickles. A file is put in place when it is whole and on the disk; the last two are
kept. What does not add up is not looked at any further. Tables that lie on all ranks are written and read in pieces.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import IO, Any
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from numpy.lib import format as format_of_arrays
from numpy.typing import NDArray

from gapbeam.solver.run.output.atomic_files import new_file, own_folder, part_of, put_in_place, written
from gapbeam.solver.run.output.parallel_tables import PIECE, ParallelTable, Pieces
from gapbeam.solver.schema.record_table import CHECKPOINT_FOLDER, CHECKPOINTS, KEPT_MODEL

VERSION = 6
KEPT = 2
MAGIC = b"gapbeam-checkpoint"
LONGEST_LINE = 256
AT_ONCE = 2**20  # bytes that are added up at once

npy: Any = format_of_arrays  # numpy has no types for it
Arrays = Mapping[str, NDArray[Any] | ParallelTable]


class BrokenCheckpoint(Exception):  # noqa: N818 - the field's word
    """A checkpoint that cannot be read; the message says why."""


@dataclass(frozen=True)
class Contents:
    """Contents of a checkpoint file.

    Attributes:
        path: Its file.
        header: Everything but arrays.
        shapes: Shapes of the arrays, by name.
        start: Position of the arrays in the file, bytes.
    """

    path: Path
    header: dict[str, Any]
    shapes: dict[str, tuple[int, ...]]
    start: int

    def array(self, name: str) -> NDArray[Any]:
        """Return a whole array.

        Raises:
            BrokenCheckpoint: The checkpoint cannot be read.
            KeyError: The checkpoint has no such array.
        """
        if name not in self.shapes:
            raise KeyError(name)
        with self._opened(name) as entry:
            return np.asarray(npy.read_array(entry, allow_pickle=False))

    def pieces(self, name: str, layered: bool = False) -> Iterator[NDArray[Any]]:
        """Yield some rows after the other of a table of numbers, layer by layer where it has layers.

        Raises:
            BrokenCheckpoint: The checkpoint cannot be read, or holds other values.
        """
        shape = self.shapes[name]
        count, row = (shape[1], shape[2:]) if layered else (shape[0], shape[1:])
        with self._opened(name) as entry:
            _, in_columns, kind = _described(entry)
            if in_columns or kind != np.float64:
                raise BrokenCheckpoint(f"its {name} holds other things than finite numbers: {kind}")
            for _ in range(shape[0] if layered else 1):
                for begin in range(0, count, PIECE):
                    rows = min(PIECE, count - begin)
                    data = entry.read(rows * prod(row) * kind.itemsize)
                    yield np.frombuffer(data, dtype=kind).reshape(rows, *row)

    @contextmanager
    def _opened(self, name: str) -> Iterator[IO[bytes]]:
        try:
            with (
                self.path.open("rb") as file,
                ZipFile(_Section(file, self.start)) as stored,  # type: ignore[call-overload]
                stored.open(f"{name}.npy") as entry,
            ):
                yield entry
        except BrokenCheckpoint:
            raise
        except Exception as error:
            raise BrokenCheckpoint(f"{type(error).__name__}: {error}") from error


class _Section:
    """A file from some byte on, for those who expect one of their own."""

    def __init__(self, file: IO[bytes], start: int) -> None:
        self._file, self._start = file, start
        self.read, self.write, self.flush = file.read, file.write, file.flush
        file.seek(start)

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._file.tell() - self._start

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._file.seek(offset + (self._start if whence == os.SEEK_SET else 0), whence)
        return self.tell()


def write_checkpoint(
    folder: Path, step: int, header: Mapping[str, Any], arrays: Arrays, pieces: Pieces, spared: Set[int] = frozenset()
) -> Path:
    """Write the checkpoint after a step to a results folder, and remove all but the last two and those to spare.

    Args:
        folder: The results folder.
        step: Steps that are done.
        header: Everything but arrays, for JSON.
        arrays: Arrays by name.
        pieces: Function that yields the pieces of arrays that are tables on all ranks.
        spared: Steps whose checkpoints stay.

    Raises:
        NotWritten: The checkpoint could not be written; earlier ones are unchanged.
    """
    path = _file_after(folder, step)
    with written(path):
        _write(path, header, arrays, pieces)
        remove_but(folder, spared, KEPT)
    return path


def _file_after(folder: Path, step: int) -> Path:
    return folder / CHECKPOINT_FOLDER / CHECKPOINTS.replace("*", f"{step:012d}")


def remove_but(folder: Path, spared: Set[int], last: int) -> None:
    """Remove the checkpoints of a results folder, except the last ones and those of given steps."""
    stay = {_file_after(folder, step) for step in spared}
    for old in found(folder)[last:]:
        if old not in stay:
            old.unlink()


def write_model(folder: Path, header: Mapping[str, Any], arrays: Arrays, pieces: Pieces) -> None:
    """Write the common part of all checkpoints of a results folder, a model of few DOFs; as `write_checkpoint`.

    Raises:
        NotWritten: The file could not be written; the one before it is unchanged.
    """
    path = model_file(folder)
    with written(path):
        _write(path, header, arrays, pieces)


def model_file(folder: Path) -> Path:
    """Return the file of the model of few DOFs from which the checkpoints of a results folder continue."""
    return folder / CHECKPOINT_FOLDER / KEPT_MODEL


def _write(path: Path, header: Mapping[str, Any], arrays: Arrays, pieces: Pieces) -> None:
    part = part_of(path)
    text = json.dumps(header).encode()
    own_folder(path.parent)
    try:
        with os.fdopen(new_file(part), "w+b") as file:
            line = _line("0" * 64, len(text), 0)
            file.write(line)
            file.write(text)
            _pack(_Section(file, len(line) + len(text)), arrays, pieces)
            size = file.seek(0, os.SEEK_END) - len(line) - len(text)
            file.seek(len(line))
            total = _added_up(file)
            file.seek(0)
            file.write(_line(total, len(text), size))
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    put_in_place(part, path)


def _line(total: str, text: int, block: int) -> bytes:
    """Return the first line, which is as long before the size of the arrays is known."""
    return f"{MAGIC.decode()} {VERSION} {total} {text} {block:015d}\n".encode()


def _pack(file: Any, arrays: Arrays, pieces: Pieces) -> None:
    """Write an .npz, as numpy does."""
    with ZipFile(file, "w", ZIP_STORED) as packed:
        for name, array in arrays.items():
            with packed.open(f"{name}.npy", "w", force_zip64=True) as entry:
                if not isinstance(array, ParallelTable):
                    npy.write_array(entry, np.asanyarray(array), allow_pickle=False)
                    continue
                kind = npy.dtype_to_descr(array.values.dtype)
                npy.write_array_header_1_0(entry, {"descr": kind, "fortran_order": False, "shape": array.shape})
                for piece in pieces(name):
                    entry.write(piece.tobytes())


def _added_up(file: IO[bytes]) -> str:
    """Return the checksum of the rest of a file."""
    total = hashlib.sha256()
    while data := file.read(AT_ONCE):
        total.update(data)
    return total.hexdigest()


def found(folder: Path) -> list[Path]:
    """Return the checkpoints of a results folder, the last one first."""
    paths = (folder / CHECKPOINT_FOLDER).glob(CHECKPOINTS)
    return sorted((path for path in paths if path.is_file()), reverse=True)


def read_checkpoint(path: Path) -> Contents:
    """Read a checkpoint.

    Raises:
        BrokenCheckpoint: The file is truncated, changed, of another version, or no checkpoint.
    """
    try:
        with path.open("rb") as file:
            line = file.readline(LONGEST_LINE)
            version, sum_, text_size, block_size = _announced(line)
            there = path.stat().st_size - len(line)
            if there != text_size + block_size:
                raise BrokenCheckpoint(f"it has {there} bytes, expected {text_size + block_size}")
            if version != VERSION:
                raise BrokenCheckpoint(f"it is of version {version}, expected {VERSION}")
            if _added_up(file) != sum_:
                raise BrokenCheckpoint("its contents are not what was written: the checksum differs")
            file.seek(len(line))
            try:
                header = json.loads(file.read(text_size))
                shapes = _shapes(_Section(file, len(line) + text_size), block_size)
            except BrokenCheckpoint:
                raise
            except Exception as error:  # a checksum that fits something which no run wrote
                raise BrokenCheckpoint(f"{type(error).__name__}: {error}") from error
    except OSError as error:
        raise BrokenCheckpoint(error.strerror or str(error)) from error
    if not isinstance(header, dict):
        raise BrokenCheckpoint("its header is not a table")
    return Contents(path, header, shapes, len(line) + text_size)


def time_of(path: Path) -> tuple[float, int]:
    """Return the time of a checkpoint, s, and its steps since the start, by its first bytes alone.

    Raises:
        BrokenCheckpoint: The time and steps cannot be read.
    """
    try:
        with path.open("rb") as file:
            header = json.loads(file.read(_announced(file.readline(LONGEST_LINE))[2]))
        return float(header["time"]), int(header["done"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise BrokenCheckpoint(f"{type(error).__name__}: {error}") from error


def _shapes(file: Any, size: int) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the arrays of an .npz, none of which is larger than the file."""
    found = {}
    with ZipFile(file) as stored:
        entries = stored.infolist()
        if sum(entry.file_size for entry in entries) > size:
            raise BrokenCheckpoint("its arrays are larger than it is")
        for entry in entries:
            name = entry.filename.removesuffix(".npy")
            with stored.open(entry) as opened:
                shape, _, kind = _described(opened)
                if kind.hasobject:
                    raise BrokenCheckpoint(f"its {name} holds pickled objects")
                if opened.tell() + prod(shape) * kind.itemsize != entry.file_size:
                    raise BrokenCheckpoint(f"its {name} is not an array of that size")
            found[name] = shape
    return found


def _described(entry: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return shape, whether column by column, and type of the array that follows."""
    version = npy.read_magic(entry)
    read = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[version]
    shape, in_columns, kind = read(entry)
    return tuple(shape), bool(in_columns), kind


def _announced(line: bytes) -> tuple[int, str, int, int]:
    match = re.fullmatch(MAGIC + rb" (\d{1,9}) ([0-9a-f]{64}) (\d{1,15}) (\d{1,15})\n", line)
    if match is None:
        raise BrokenCheckpoint("it is empty or no checkpoint of gapbeam")
    version, sum_, text, block = match.groups()
    return int(version), sum_.decode(), int(text), int(block)
