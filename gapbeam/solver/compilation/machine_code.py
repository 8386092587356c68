"""numba, and its cache of machine code, which `gapbeam.solver.compilation.jit` loads with the first compilation."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Flags, compile_extra
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]
from numba.core.runtime import rtsys

Report = Callable[[object, Exception], None]


class _LinkedCode(JITCodeLibrary):  # type: ignore[misc]  # numba has no types
    """Code that only compiled code calls: optimized where it is linked in, and never made machine code by itself."""

    def _optimize_final_module(self) -> None:
        """Leave the optimization to the module that this one is linked into."""

    def _finalize_final_module(self) -> None:
        """Make no machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True


class _LinkedCompiler(_FunctionCompiler):  # type: ignore[misc]
    """Compiler of functions that only compiled code calls, which leaves all but types and linking to their callers.

    numba would optimize each of them by itself and make machine code of it, and do both again where it is called.
    """

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        flags = Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        context = self.targetdescr.target_context
        library = _LinkedCode(context.codegen(), self.py_func.__qualname__)
        made = compile_extra(
            self.targetdescr.typing_context, context, self.py_func, args, return_type, flags, self.locals, library,
            self.pipeline_class,
        )  # fmt: skip
        handle = list[Any]().append  # stands for the function in tables of numba, which take a built-in function
        context.insert_user_function(handle, made.fndesc, [library])
        return made._replace(entry_point=handle)


def linked(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Return a function that compiled code may call, and Python may not; `options` are those of numba."""
    made = numba.njit(**options)(function)
    own = made._compiler
    made._compiler = _LinkedCompiler(own.py_func, own.targetdescr, own.targetoptions, own.locals, own.pipeline_class)
    return made


def dispatcher(function: Callable[..., Any], options: dict[str, Any], folder: Path | None, report: Report) -> Any:
    """Return a function that numba compiles when it is called.

    Args:
        function: Function in Python.
        options: Options of numba.
        folder: Folder for its machine code; None: it is not kept.
        report: Called with the folder and the error where machine code cannot be kept or read.
    """
    if folder is None:
        return numba.njit(**options)(function)
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        made = numba.njit(**options)(function)
        made._cache = _DispensableCache(function)
        made._cache.report = report
        made._compilation_chain_init_hook = lambda: None  # extensions of numba are for what compiles
    finally:
        config.CACHE_DIR = before
    return made


class _DispensableCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """Machine code on the disk, which a run does without where it cannot be kept or read.

    numba ends the caller where the disk is full, and where what a full disk left is cut.
    """

    report: Report

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return machine code; None where there is none, or none that can be read.

        Linking it takes the functions of numba's runtime alone: what compiles loads all others by itself, for longer.
        """
        try:
            rtsys.initialize(target_context)
            return self._load_overload(sig, target_context)
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
