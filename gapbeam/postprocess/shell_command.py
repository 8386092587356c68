"""Commands as a reader can copy them into a shell."""

from __future__ import annotations

import shlex
from pathlib import Path


def shell_command(*words: str | Path) -> str:
    """Return a command whose words, paths of users among them, a shell takes as they are.

    Args:
        words: The program, its options and arguments, one a word; a path that looks like an option gets `./` in front.
    """
    return shlex.join(_argument(word) if isinstance(word, Path) else word for word in words)


def _argument(path: Path) -> str:
    return f"./{path}" if str(path).startswith("-") else str(path)
