"""Answers that are kept on disk: a study that was killed continues where it was, to the same bits."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.scene.ensemble_members import EnsembleFolder
from gapbeam.solver.system.operators import Array
from gapbeam.studies.uncertain.member_responses import Answers

BLOCK = 1024
"""Members that march together: memory stays bounded, and so does what an interruption loses."""
KEPT = "kept"


class KeptAnswers:
    """A model whose answers are computed in blocks, and kept in a folder if there is one.

    Args:
        model: Returns answers at values by path.
        folder: Of the study; None keeps nothing.
        key: Hash of the model.
        progress: Called with the number of members that are done.

    Raises:
        UserError: The folder has another study.
        NotWritten: The folder takes no file.
    """

    def __init__(
        self, model: Callable[[dict[str, Array]], Answers], folder: Path | None, key: str | None,
        progress: Callable[[int], None] | None = None,
    ) -> None:  # fmt: skip
        self.model, self.progress, self.done = model, progress, 0
        self.folder = None if folder is None else EnsembleFolder(folder / KEPT, str(key))

    def __call__(self, values: dict[str, Array]) -> Answers:
        """Return the answers at values, (members,) by path."""
        count = len(next(iter(values.values())))
        parts = []
        for first in range(0, count, BLOCK):
            parts.append(self.block({path: value[first : first + BLOCK] for path, value in values.items()}))
            self.done += len(parts[-1].response)
            if self.progress is not None:
                self.progress(self.done)
        names = list(dict.fromkeys(name for part in parts for name in part.figures))
        missing = [np.full(len(part.response), np.nan) for part in parts]
        figures = {
            name: np.concatenate([part.figures.get(name, none) for part, none in zip(parts, missing, strict=True)])
            for name in names
        }
        return Answers(np.concatenate([part.response for part in parts]), figures)

    def block(self, values: dict[str, Array]) -> Answers:
        """Return the answers of a block, from disk where they are there."""
        if self.folder is None:
            return self.model(values)
        digest = hashlib.sha256(repr(list(values)).encode())
        for value in values.values():
            digest.update(np.ascontiguousarray(value).tobytes())
        name = f"{digest.hexdigest()[:24]}.npz"
        path = self.folder.path / name
        if path.exists():
            with np.load(path) as arrays:
                figures = {key[2:]: arrays[key] for key in arrays.files if key.startswith("f/")}
                return Answers(arrays["response"].astype(object), figures)
        found = self.model(values)
        arrays_: dict[str, Any] = {f"f/{key}": value for key, value in found.figures.items()}
        self.folder.write(name, lambda file: np.savez(file, response=found.response.astype(str), **arrays_))
        return found
