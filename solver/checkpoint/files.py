"""Checkpoint files: a line of text that says what follows and how it adds up, then JSON and arrays.

    gapbeam-checkpoint VERSION SHA256 BYTES-OF-JSON BYTES-OF-ARRAYS

The arrays are a numpy .npz without pickles. A file is put in place when it is whole and on the disk; the last two are
kept. What does not add up is not looked at any further.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.output.records import CHECKPOINT_FOLDER, CHECKPOINTS
from solver.output.storage import put_in_place, written

VERSION = 1
KEPT = 2
MAGIC = b"gapbeam-checkpoint"
LONGEST_LINE = 256

Arrays = Mapping[str, NDArray[Any]]


class BrokenCheckpoint(Exception):  # noqa: N818 - the field's word
    """A checkpoint that cannot be read; the message says why."""


@dataclass(frozen=True)
class Contents:
    """What a checkpoint holds.

    Attributes:
        path: Its file.
        header: Everything but arrays.
        arrays: By name.
    """

    path: Path
    header: dict[str, Any]
    arrays: dict[str, NDArray[Any]]


def write_checkpoint(folder: Path, step: int, header: Mapping[str, Any], arrays: Arrays) -> Path:
    """Write the checkpoint after a step to a results folder, and remove all but the last two.

    Raises:
        NotWritten: It could not be written; those before it are as they were.
    """
    path = folder / CHECKPOINT_FOLDER / CHECKPOINTS.replace("*", f"{step:012d}")
    part = path.with_name(path.name + ".part")
    text = json.dumps(header).encode()
    packed = io.BytesIO()
    np.savez(packed, **arrays)  # type: ignore[arg-type]
    block = packed.getbuffer()
    total = hashlib.sha256(text)
    total.update(block)
    with written(path):
        path.parent.mkdir(exist_ok=True)
        try:
            with part.open("wb") as file:
                line = f"{MAGIC.decode()} {VERSION} {total.hexdigest()} {len(text)} {len(block)}\n"
                file.write(line.encode())
                file.write(text)
                file.write(block)
        except OSError:
            part.unlink(missing_ok=True)
            raise
        put_in_place(part, path)
        for old in found(folder)[KEPT:]:
            old.unlink()
    return path


def found(folder: Path) -> list[Path]:
    """Return the checkpoints of a results folder, the last one first."""
    paths = (folder / CHECKPOINT_FOLDER).glob(CHECKPOINTS)
    return sorted((path for path in paths if path.is_file()), reverse=True)


def read_checkpoint(path: Path) -> Contents:
    """Read a checkpoint.

    Raises:
        BrokenCheckpoint: It is truncated, changed, of another version, or none at all.
    """
    try:
        with path.open("rb") as file:
            line = file.readline(LONGEST_LINE)
            version, sum_, text_size, block_size = _announced(line)
            there = path.stat().st_size - len(line)
            if there != text_size + block_size:
                raise BrokenCheckpoint(f"it has {there} bytes, expected {text_size + block_size}")
            body = file.read()
    except OSError as error:
        raise BrokenCheckpoint(error.strerror or str(error)) from error
    if version != VERSION:
        raise BrokenCheckpoint(f"it is of version {version}, expected {VERSION}")
    if hashlib.sha256(body).hexdigest() != sum_:
        raise BrokenCheckpoint("its contents are not what was written: the checksum differs")
    try:
        header = json.loads(body[:text_size])
        with np.load(io.BytesIO(body[text_size:]), allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except Exception as error:  # a checksum that fits something which no run wrote
        raise BrokenCheckpoint(f"{type(error).__name__}: {error}") from error
    if not isinstance(header, dict):
        raise BrokenCheckpoint("its header is not a table")
    return Contents(path, header, arrays)


def _announced(line: bytes) -> tuple[int, str, int, int]:
    match = re.fullmatch(MAGIC + rb" (\d{1,9}) ([0-9a-f]{64}) (\d{1,15}) (\d{1,15})\n", line)
    if match is None:
        raise BrokenCheckpoint("it is empty or no checkpoint of gapbeam")
    version, sum_, text, block = match.groups()
    return int(version), sum_.decode(), int(text), int(block)
