"""Compilation by numba, and the cache of compiled code.

Compiled code is kept in $NUMBA_CACHE_DIR, or else $XDG_CACHE_HOME/gapbeam (~/.cache/gapbeam), in a folder named after
the sources that numba compiles: numba looks for changes only in the file of a function, not in the files of the
functions that it calls. Where that folder cannot be written, every process compiles again, and nothing else changes.

numba takes as long to load as all else that reads a case: it is loaded when the first function is called or compiled.
"""

from __future__ import annotations

import hashlib
import logging
import os
import signal
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])
MARK = b"gapbeam.solver.compilation.jit"  # a file that compiles functions imports them from this module
HEARD = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1, signal.SIGALRM)  # what ends a run
POLL = 0.05  # s between looks at a process that compiles
REORDERED = {"reassoc", "contract", "nsz"}  # sums may be reordered for SIMD; infinities and NaN keep their meaning


def cache_home() -> Path | None:
    """Return the folder for all that outlives a process, which need not be there; None where there is no home."""
    home = os.environ.get("XDG_CACHE_HOME")
    try:
        return (Path(home) if home else Path.home() / ".cache") / "gapbeam"
    except RuntimeError:
        return None


def cache_base() -> Path | None:
    """Return the folder for all compiled code, which need not be there; None where there is no home."""
    given, home = os.environ.get("NUMBA_CACHE_DIR"), cache_home()
    return Path(given) if given else None if home is None else home / "compiled"


@cache
def sources() -> dict[Path, bytes]:
    """Return the sources that set-ups and machine code follow from, those for meshes first."""
    top = Path(__file__).parents[2]
    return {path: path.read_bytes() for part in ("meshes", "solver") for path in sorted((top / part).rglob("*.py"))}


@cache
def cache_folder() -> Path | None:
    """Return the folder for compiled code of these very sources, made if need be; None where none can be written."""
    base = cache_base()
    if base is None:
        return None
    digest = hashlib.sha256()
    for text in sources().values():
        if MARK in text:
            digest.update(text)
    try:
        folder = base / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return None


def report_not_kept(folder: object, error: Exception) -> None:
    """Warn, once a process, that machine code cannot be kept in a folder, with advice."""
    if not _SAID:
        _SAID.append(str(folder))
        LOG.warning(
            "machine code cannot be kept in %s (%s): each run compiles it anew; look for a full disk or a quota, "
            "or set XDG_CACHE_HOME",
            folder,
            getattr(error, "strerror", None) or type(error).__name__,
        )


LOG = logging.getLogger("gapbeam")
_SAID: list[str] = []  # folders of which was said that they keep nothing: the first one of a process
IN_ORDER: dict[str, Any] = {"fastmath": False, "error_model": "numpy"}  # False is written: otherwise the caller's holds
_OPTIONS: dict[str, Any] = {"fastmath": REORDERED, "error_model": "numpy", "_nrt": False}


def is_kept(function: Callable[..., Any]) -> bool:
    """Return whether machine code of an entry is kept, in any of its variants.

    Several installations of the same sources share a folder, and each has code of its own there.
    """
    if cache_folder() is None:
        return False
    name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}-*.nbc"
    return next(Path(function.stats.cache_path).glob(name), None) is not None  # type: ignore[attr-defined]


def is_pending(function: Callable[..., Any]) -> bool:
    """Return whether machine code of an entry could be kept, and is not yet."""
    return cache_folder() is not None and not is_kept(function)


def compile_in_another_process(call: Callable[[], object], look: Callable[[], None]) -> None:
    """Call an entry in a child process, which leaves its machine code in the cache.

    Compilation spends seconds inside LLVM, where Python hears no signal; this process hears signals meanwhile. Where
    the child fails, the entry is compiled when this process calls it.

    Args:
        call: Calls the entry on what it will be called on, without lasting effects outside of its memory.
        look: Called twenty times a second meanwhile; an error that it, or a signal handler, raises kills the child.
    """
    noted: list[int] = []
    handlers = _only_noting(noted)  # an error of a handler that came between fork and try would leave the child behind
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forks beside threads: the child uses none of these
        child = os.fork()
    if child == 0:
        try:
            for number in HEARD:
                signal.signal(number, signal.SIG_DFL)
            call()
        finally:
            os._exit(0)
    ended = False
    try:
        for heard, handler in handlers.items():
            signal.signal(heard, handler)
        for came in noted:
            signal.raise_signal(came)
        while not ended:
            look()
            ended = os.waitpid(child, os.WNOHANG)[0] != 0
            time.sleep(0.0 if ended else POLL)
    finally:
        if not ended:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _only_noting(noted: list[int]) -> dict[int, Any]:
    """Have the signals that end a run noted, and return their handlers; a mask of this thread leaves them to others.

    Outside the main thread no handler interrupts: there is nothing to do.
    """
    if threading.current_thread() is not threading.main_thread():
        return {}
    heard = [number for number in HEARD if callable(signal.getsignal(number))]
    return {number: signal.signal(number, lambda came, _: noted.append(came)) for number in heard}


class _Late:
    """A function that numba compiles, which loads numba when it is first called, or called by compiled code.

    For compiled code it is part of its callers; Python calls another copy.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        update_wrapper(self, function)
        self.py_func, self._options = function, options

    @cached_property
    def _made(self) -> Any:
        from gapbeam.solver.compilation.machine_code import linked

        return linked(self.py_func, self._options)

    @cached_property
    def _called(self) -> Any:
        """The copy that Python calls."""
        from gapbeam.solver.compilation.machine_code import dispatcher

        return dispatcher(self.py_func, self._options, None, report_not_kept)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._called(*arguments, **named)

    def __getattr__(self, name: str) -> Any:  # `_numba_type_` among others, by which numba knows what it calls
        if name in ("py_func", "_options"):  # of an object that is not made yet
            raise AttributeError(name)
        return getattr(self._made, name)

    def __reduce__(self) -> str:
        return str(self.py_func.__qualname__)  # its name in its module, from which another process takes it


class _Entry(_Late):
    """One that Python calls, whose machine code is kept."""

    @cached_property
    def _made(self) -> Any:
        from gapbeam.solver.compilation.machine_code import dispatcher

        return dispatcher(self.py_func, self._options | {"no_cfunc_wrapper": True}, cache_folder(), report_not_kept)

    @property
    def _called(self) -> Any:
        return self._made


class _Shared(_Late):
    """One that Python calls as it stands."""

    @property
    def _called(self) -> Any:
        return self.py_func


def part(function: Function, options: dict[str, Any]) -> Function:
    """Compile a function as part of the entries that call it; `options` are those of numba."""
    made: Function = _Late(function, options)  # type: ignore[assignment]
    return made


def compiled(function: Function) -> Function:
    """Compile a function of numbers and arrays that entries call, as part of these.

    Its code is copied to where it is called: a call copies every array of the tables that it is given, in every step.
    """
    return part(function, _OPTIONS | {"forceinline": True})


def compiled_apart(function: Function) -> Function:
    """Compile like `compiled`, but as a called function: for long ones called from several places, or rarely."""
    return part(function, _OPTIONS | {"forceinline": False})  # False is written: otherwise the caller's holds


def allocating(function: Function) -> Function:
    """Compile like `compiled` a function that makes arrays."""
    return part(function, _OPTIONS | {"_nrt": True})


def shared(function: Function) -> Function:
    """Compile a function of numbers where kernels call it; Python calls it as it stands."""
    made: Function = _Shared(function, _OPTIONS)  # type: ignore[assignment]
    return made


def compiled_in_order(function: Function) -> Function:
    """Compile like `compiled`, keeping the written order of operations: the same digits wherever it is called from."""
    return part(function, IN_ORDER | {"forceinline": True})


def entry(function: Function) -> Function:
    """Compile a function that Python calls when it is first called; keep the machine code for later processes."""
    return kept(function, _OPTIONS)


def long_entry(function: Function) -> Function:
    """Compile like `entry` a function that takes a while: other threads of Python run meanwhile."""
    return kept(function, _OPTIONS | {"nogil": True})


def twin(function: Any, name: str, **others: Any) -> Any:
    """Compile the source of a long entry once more: machine code of its own, kept apart by its name.

    A function that both called would be optimized twice, as itself and where it is called.

    Args:
        function: The entry.
        name: Name of the twin.
        others: Functions that it calls in place of its own of the same names.
    """
    source = function.py_func
    code = source.__code__.replace(co_name=name, co_qualname=name)
    return long_entry(FunctionType(code, source.__globals__ | others, name))


def allocating_entry(function: Function) -> Function:
    """Compile like `entry` a function that makes arrays."""
    return kept(function, _OPTIONS | {"_nrt": True})


def kept(function: Function, options: dict[str, Any]) -> Function:
    """Compile a function when it is first called, and keep the machine code; `options` are those of numba."""
    made: Function = _Entry(function, options)  # type: ignore[assignment]
    return made
