"""Machine code kept on disk, named after a hash of everything that it depends on.

The cache of numba misses closures, and does not see edits of functions that are called in other files. Here the name is
a hash of the bytecode, the constants, the closure and the globals of a function and, recursively, of all that it calls:
an edit anywhere gives another name. Where the folder cannot be written, every process compiles again.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np
from numba.core.registry import cpu_target

from gapbeam.solver.compilation.jit import cache_base, report_not_kept

counts = {"compiled": 0, "loaded": 0}
"""Touches that this process compiled, and that it found."""


def fingerprint(*values: Any) -> str:
    """Return a hash of values; of functions with all that they depend on.

    Raises:
        TypeError: A function depends on an object that has no fingerprint.
    """
    digest = hashlib.sha256()
    seen: dict[int, tuple[int, Any]] = {}

    def add(x: Any) -> None:
        if isinstance(x, str | bytes | int | float | complex | bool | None | np.generic) or x is Ellipsis:
            digest.update(f"{type(x).__name__} {x!r};".encode())
        elif id(x) in seen:
            digest.update(f"again {seen[id(x)][0]};".encode())
        else:
            seen[id(x)] = len(seen), x  # kept alive: an id is not used twice
            digest.update(type(x).__name__.encode())
            if hasattr(x, "py_func"):
                add(x.py_func)
            elif isinstance(x, FunctionType):
                names = set(_names(x.__code__))
                parts = [x.__code__, x.__defaults__, {n: x.__globals__[n] for n in sorted(names & set(x.__globals__))}]
                for part in parts + [c.cell_contents for c in x.__closure__ or ()]:
                    add(part)
            elif isinstance(x, CodeType):
                for part in (x.co_code, x.co_consts, x.co_names, x.co_varnames, x.co_argcount):
                    add(part)
            elif isinstance(x, np.ndarray):
                add((x.dtype.str, x.shape, x.tobytes()))
            elif isinstance(x, dict):
                add(tuple(x.items()))
            elif isinstance(x, tuple | list | frozenset):
                for part in sorted(x, key=repr) if isinstance(x, frozenset) else x:
                    add(part)
            elif isinstance(x, ModuleType | BuiltinFunctionType | type | np.ufunc):
                add((x.__name__, ""))
            else:
                raise TypeError(f"a compiled function depends on {x!r}, which has no fingerprint")

    processor = cpu_target.target_context.codegen().magic_tuple()
    for value in (*values, version("numba"), version("llvmlite"), sys.version, processor):
        add(value)
    return digest.hexdigest()[:32]


def _names(code: CodeType) -> Iterator[str]:
    """Yield the names that a code object and those inside it look up."""
    yield from code.co_names
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _names(one)


_kept: dict[str, tuple[Any, int]] = {}


def address(signature: Any, function: Callable[..., Any]) -> int:
    """Return the address of a compiled C function: of this process, of the folder, or compiled now."""
    key = fingerprint(str(signature), function)
    if key not in _kept:
        base = cache_base()
        file = None if base is None else base / "touches" / key
        try:
            state, symbol = pickle.loads(file.read_bytes() if file else b"")
            cpu_target.target_context.refresh()  # symbols of numba's runtime: without them LLVM ends the process
            library = cpu_target.target_context.codegen().unserialize_library(state)
            counts["loaded"] += 1
        except Exception:  # there is none, or it is damaged
            compiled = numba.cfunc(signature, error_model="numpy")(function)
            library, symbol = compiled._library, compiled._wrapper_name
            counts["compiled"] += 1
            if file:
                _keep(file, pickle.dumps((library.serialize_using_object_code(), symbol)))
        _kept[key] = library, library.get_pointer_to_function(symbol)
    return _kept[key][1]


def _keep(file: Path, code: bytes) -> None:
    """Write machine code, whole or not at all."""
    part = file.with_suffix(f".{os.getpid()}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(code)
        part.replace(file)
    except OSError as error:
        report_not_kept(file.parent, error)
