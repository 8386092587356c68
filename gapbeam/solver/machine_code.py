"""numba, and its cache of machine code, which `gapbeam.solver.jit` loads with the first compilation."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import FunctionCache
from numba.extending import register_jitable

__all__ = ["dispatcher", "register_jitable"]

Report = Callable[[object, Exception], None]


def dispatcher(function: Callable[..., Any], options: dict[str, Any], folder: Path | None, report: Report) -> Any:
    """Return a function that numba compiles when it is called.

    Args:
        function: In Python.
        options: Those of numba.
        folder: For its machine code; None: it is not kept.
        report: Called with the folder and the error where machine code cannot be kept or read.
    """
    if folder is None:
        return numba.njit(**options)(function)
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        made = numba.njit(**options)(function)
        made._cache = _DispensableCache(function)
        made._cache.report = report
    finally:
        config.CACHE_DIR = before
    return made


class _DispensableCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """Machine code on the disk, which a run does without where it cannot be kept or read.

    numba ends the caller where the disk is full, and where what a full disk left is cut.
    """

    report: Report

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return machine code; None where there is none, or none that can be read."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:
            self._forget(error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, where that is possible."""
        try:
            super().save_overload(sig, data)
        except (OSError, EOFError, pickle.PickleError) as error:
            self._forget(error)

    def _forget(self, error: Exception) -> None:
        """Remove the index, which leads to code that is not there, and say that this process compiles for itself."""
        with suppress(OSError):
            Path(self._cache_file._index_path).unlink(missing_ok=True)
        self.report(self.cache_path, error)
