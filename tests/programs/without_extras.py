"""Run the command gapbeam in an interpreter that has no package of an extra: `python3 -m ... ARGUMENT ...`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

from gapbeam.process.extra_packages import EXTRAS


class Installed(PathFinder):
    """Finds what is installed without extras."""

    @classmethod
    def find_spec(
        cls, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module that belongs to no extra."""
        return None if name.partition(".")[0] in EXTRAS else super().find_spec(name, path, target)


sys.meta_path[sys.meta_path.index(PathFinder)] = Installed

from gapbeam.command_line import main  # noqa: E402 - from here on nothing absent can be imported

main()
