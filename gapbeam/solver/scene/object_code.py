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
from functools import cached_property, partial
from importlib.metadata import version
from pathlib import Path
from types import BuiltinFunctionType, CellType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numba
import numpy as np
from numba.core.registry import cpu_target

from gapbeam.solver.compilation.jit import cache_base, report_not_kept

counts = {"compiled": 0, "loaded": 0}
"""Touches that this process compiled, and that it found."""


def fingerprint(*values: Any, strict: bool = False) -> str:
    """Return a hash of values: of functions with all that they depend on, of objects with their attributes.

    Args:
        values: The values. Private and computed attributes of this package's objects do not count.
        strict: Refuses an object without attributes that cannot be pickled; else its class stands for it.

    Raises:
        TypeError: An object has no fingerprint.
    """
    found: dict[int, tuple[bytes, Any]] = {}

    def of(x: Any) -> bytes:
        if isinstance(x, str | bytes | int | float | complex | bool | None | np.generic) or x is Ellipsis:
            return f"{type(x).__name__} {x!r}".encode()
        if id(x) not in found:
            found[id(x)] = b"itself", x  # kept alive: an id is not used twice
            parts = map(of, (type(x).__qualname__, *parts_of(x)))
            found[id(x)] = hashlib.sha256(b"".join(b"%d %b;" % (len(one), one) for one in parts)).digest(), x
        return found[id(x)][0]

    def parts_of(x: Any) -> tuple[Any, ...]:
        if hasattr(x, "py_func"):
            return (x.py_func,)
        if isinstance(x, FunctionType):
            names = sorted(set(_names(x.__code__)) & set(x.__globals__))
            known = {name: x.__globals__[name] for name in names}
            return x.__code__, x.__defaults__, x.__kwdefaults__, known, *(_content(c) for c in x.__closure__ or ())
        if isinstance(x, CodeType):
            return x.co_code, x.co_consts, x.co_names, x.co_varnames, x.co_argcount
        if isinstance(x, np.ndarray):
            return x.dtype.str, x.shape, x.tolist() if x.dtype.hasobject else x.tobytes()
        if isinstance(x, dict):
            return tuple(x.items())
        if isinstance(x, tuple | list | set | frozenset):
            return tuple(sorted(x, key=repr)) if isinstance(x, set | frozenset) else tuple(x)
        if isinstance(x, partial):
            return x.func, x.args, x.keywords
        if isinstance(x, MethodType):
            return x.__func__, x.__self__
        if isinstance(x, ModuleType | BuiltinFunctionType | type | np.ufunc):
            return (x.__name__,)
        if hasattr(x, "__dict__"):
            return tuple(_attributes(x))
        try:
            return (pickle.dumps(x),)
        except Exception as error:  # whatever a class may raise
            if strict:
                raise TypeError(f"a compiled function depends on {x!r}, which has no fingerprint") from error
            return ()

    return hashlib.sha256(b"".join(map(of, values))).hexdigest()[:32]


def _content(cell: CellType) -> Any:
    """Return the value of a name of a closure; None before it has one."""
    try:
        return cell.cell_contents
    except ValueError:
        return None


def _attributes(x: Any) -> Iterator[tuple[str, Any]]:
    """Yield names and values of the attributes of an object."""
    own = type(x).__module__.startswith("gapbeam.")
    for name, value in vars(x).items():
        if not own or not (name.startswith("_") or isinstance(getattr(type(x), name, None), cached_property)):
            yield name, value


def _names(code: CodeType) -> Iterator[str]:
    """Yield the names that a code object and those inside it look up."""
    yield from code.co_names
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _names(one)


_kept: dict[str, tuple[Any, int]] = {}


def address(signature: Any, function: Callable[..., Any]) -> int:
    """Return the address of a compiled C function: of this process, of the folder, or compiled now."""
    machine = version("numba"), version("llvmlite"), sys.version, cpu_target.target_context.codegen().magic_tuple()
    key = fingerprint(str(signature), function, machine, strict=True)
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
