"""The folder of an ensemble: finished blocks, so that an ensemble that was killed continues where it was."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.errors import NotWritten, UserError
from gapbeam.solver.scene.ensemble_members import Members, filled
from gapbeam.solver.scene.scene import Scene, SceneState

SAMPLES = 50
"""Times at which loads and walls are compared with those of the blocks that are there."""


class EnsembleFolder:
    """Blocks of members as files, each written whole or not at all.

    Args:
        path: The folder; made where it is missing.
        key: Hash of all that the results follow from.

    Raises:
        UserError: The folder has blocks of another ensemble.
        NotWritten: The disk takes no file.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path, note = path, path / "ensemble.json"
        if note.exists():
            found = json.loads(note.read_text()).get("key")
            if found != key:
                raise UserError(
                    f"ensemble: {path} has blocks of another ensemble (scene, values, steps or features differ); "
                    "give another folder, or remove this one"
                )
            return
        if path.exists() and any(path.iterdir()):
            raise UserError(f"ensemble: {path} is not empty and holds no ensemble; give another folder")
        self._write(note, lambda file: file.write(json.dumps({"key": key}).encode()))

    def _write(self, path: Path, write: Any) -> None:
        part = path.with_name(path.name + ".part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with part.open("wb") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
        except OSError as error:
            with suppress(OSError):
                part.unlink()
            raise NotWritten(
                f"{path} could not be written: {error.strerror}; make room, and call again: finished blocks are kept"
            ) from error

    def block(self, number: int, scene: Scene) -> Members | None:
        """Return a finished block, or None."""
        path = self.path / f"block_{number:06d}.npz"
        if not path.exists():
            return None
        with np.load(path) as arrays:
            return filled(dict(arrays), [one.name or i for i, one in enumerate(scene.contacts)])

    def keep(self, number: int, members: Members) -> None:
        """Write a block."""
        self.write(f"block_{number:06d}.npz", lambda file: np.savez(file, **members.flat()))

    def write(self, name: str, write: Any) -> None:
        """Write another file, whole or not at all: `write` takes the open file.

        Raises:
            NotWritten: The disk takes no file.
        """
        self._write(self.path / name, write)


def ensemble_key(
    scene: Scene, values: dict[str, Any], count: int, start: SceneState, times: Any, *numbers: Any
) -> str:  # fmt: skip
    """Return a hash of scene, values, start and numbers: two ensembles of one key have the same results."""
    digest = hashlib.sha256(repr(numbers).encode())

    def feed(array: Any) -> None:
        digest.update(np.ascontiguousarray(array, dtype=float).tobytes())

    for path, value in sorted(values.items()):
        digest.update(path.encode())
        feed(value)
    for array in (scene.squares, scene.damping, scene.contact_rows, scene.load_columns, start.q, start.v, start.z):
        feed(array)
    for one in scene.contacts:
        digest.update(f"{one.name} {one.region.kind.name} {one.law.kind.names} {one.law.kind.name}".encode())
        functions: Any = (one.region.kind.face, one.law.kind.spring, one.law.kind.potential, one.law.kind.damper)
        for function in functions:
            digest.update(b"" if function is None else function.py_func.__code__.co_code)
        for value in (*one.values(1.0), one.place_at_rest):
            feed(value)
    for each in scene.feedbacks:
        for array in (each.A, each.B, each.C, each.D):
            feed(array)
    for load in scene.loads:
        feed(load.table(times, count))
    feed(scene.walls(times))
    return digest.hexdigest()
