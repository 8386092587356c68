"""Compilation of forms by FFCx in DOLFINx: the cache folder, and interrupted compilations in it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dolfinx import default_scalar_type, jit
from mpi4py import MPI

PREFIX = "libffcx_"
"""Prefix of the files of a form in the cache: C file, library, object file, and a mark of completion."""


def cache_of_dolfinx() -> Path:
    """Return the folder of DOLFINx's compiled forms, by default or as the user's options say."""
    return Path(jit.get_options()["cache_dir"])


def compile_here(form: Any, options: dict[str, str]) -> None:
    """Compile a UFL form in this process alone, into the cache that the options name."""
    jit.ffcx_jit(MPI.COMM_SELF, form, {"scalar_type": default_scalar_type}, options)


def half_made(cache: Path) -> Iterator[list[Path]]:
    """Yield the files of each form in a cache whose library or mark is missing.

    The folder is listed once: with thousands of forms, a search for each of them would take seconds.
    """
    parts: dict[str, set[str]] = {}
    for path in cache.iterdir():
        if path.name.startswith(PREFIX):
            stem, _, suffix = path.name.partition(".")
            parts.setdefault(stem, set()).add(suffix)
    for stem, suffixes in parts.items():
        made = "c.cached" in suffixes and any(suffix.endswith("so") for suffix in suffixes)
        if "c" in suffixes and not made:
            yield [cache / f"{stem}.{suffix}" for suffix in sorted(suffixes)]
