"""How functions of this package are compiled, and where what was compiled is kept.

Compiled code is kept in $NUMBA_CACHE_DIR, or else $XDG_CACHE_HOME/gapbeam (~/.cache/gapbeam), in a folder named after
the sources of this package: numba looks for changes only in the file of a function, not in those that it calls. Where
that folder cannot be written every process compiles anew, and nothing else changes.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config

Function = TypeVar("Function", bound=Callable[..., Any])
REORDERED = {"reassoc", "contract", "nsz"}  # sums may be reordered for SIMD; infinities and NaN keep their meaning


def cache_folder() -> Path | None:
    """Return the folder for compiled code of these very sources, made if need be; None where none can be written."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    home = os.environ.get("XDG_CACHE_HOME")
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    try:
        base = Path(given) if given else (Path(home) if home else Path.home() / ".cache") / "gapbeam" / "compiled"
        folder = base / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):
        return None


_FOLDER = cache_folder()


def is_kept(function: Callable[..., Any]) -> bool:
    """Return whether machine code of a function is kept, in any of its variants."""
    name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}-*.nbc"
    return _FOLDER is not None and next(_FOLDER.rglob(name), None) is not None


def compiled(function: Function) -> Function:
    """Compile a function of numbers and arrays when it is first called; keep the machine code for later processes."""
    options: dict[str, Any] = {"fastmath": REORDERED, "error_model": "numpy"}
    if _FOLDER is None:
        made: Function = numba.njit(**options)(function)
        return made
    before, config.CACHE_DIR = config.CACHE_DIR, str(_FOLDER)
    try:
        made = numba.njit(cache=True, **options)(function)
    finally:
        config.CACHE_DIR = before
    return made
