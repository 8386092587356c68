"""How DOLFINx compiles forms with FFCx: where, and what it leaves in its cache."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dolfinx import default_scalar_type, jit
from mpi4py import MPI

SOURCES = "libffcx_*.c"
"""Pattern of the C files in the cache; each has a library, an object file and a mark that it is done."""


def cache_of_dolfinx() -> Path:
    """Return where DOLFINx keeps compiled forms, by default or as the user's options say."""
    return Path(jit.get_options()["cache_dir"])


def compile_here(form: Any, options: dict[str, str]) -> None:
    """Compile a UFL form in this process alone, into the cache that the options name."""
    jit.ffcx_jit(MPI.COMM_SELF, form, {"scalar_type": default_scalar_type}, options)


def mark_of(source: Path) -> Path:
    """Return the empty file that DOLFINx makes when the library of a C file is done."""
    return source.with_suffix(".c.cached")


def libraries_of(source: Path) -> list[Path]:
    """Return the libraries that were made of a C file."""
    return list(source.parent.glob(f"{source.stem}.*.so"))
