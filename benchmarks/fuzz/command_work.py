"""A command of the command line as work that the fuzzer attempts."""

from __future__ import annotations

from collections.abc import Callable

Work = Callable[[], int]


def command(*words: object) -> Work:
    """Return the work of a whole command in this process."""

    def work() -> int:
        from gapbeam.command_line import _dispatch

        return _dispatch([str(word) for word in words], True)

    return work
