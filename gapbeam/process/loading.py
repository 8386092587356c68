"""Interrupts while libraries load: nothing is there to save, and some libraries abort on an exception."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Any

INTERRUPTED = 130
AGAIN = 0.01  # s, after which an interrupt comes again that a library has dropped
IMPORTING = ("importlib._bootstrap", "_frozen_importlib")  # the latter until importlib itself is loaded


def leave_quietly_while_loading() -> None:
    """Let SIGINT end the command at once while it imports something; elsewhere it raises KeyboardInterrupt as before.

    Where a library drops that, as in a callback of a collected object, SIGINT comes again.

    Processes other than the command `gapbeam` keep their handler, so Python sessions and workers of studies.
    """
    if _is_the_command() and signal.getsignal(signal.SIGINT) == signal.default_int_handler:
        signal.signal(signal.SIGINT, _hear)
        usual = sys.unraisablehook

        def let_go(lost: Any) -> None:
            if not isinstance(lost.exc_value, KeyboardInterrupt):
                usual(lost)
                return
            import threading

            threading.Timer(AGAIN, os.kill, (os.getpid(), signal.SIGINT)).start()

        sys.unraisablehook = let_go


def _is_the_command() -> bool:
    """Return whether this process was started as `gapbeam` or `python -m gapbeam`, and not by one that was."""
    called = Path(sys.argv[0]).name if sys.argv else ""
    if called == "-m":
        words = sys.orig_argv
        called = words[words.index("-m") + 1] if "-m" in words[:-1] else ""
    processes = sys.modules.get("multiprocessing.process")  # loaded in every process that another one has started
    return called == "gapbeam" and (processes is None or processes.parent_process() is None)


def _hear(number: int, frame: FrameType | None) -> None:
    if _imports(frame):
        os.write(2, b"gapbeam: interrupted\n")
        os._exit(INTERRUPTED)
    signal.default_int_handler(number, frame)


def _imports(frame: FrameType | None) -> bool:
    """Return whether an import is under way."""
    while frame is not None:
        if frame.f_globals.get("__name__") in IMPORTING:
            return True
        frame = frame.f_back
    return False
