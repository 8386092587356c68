"""Run the command gapbeam in an interpreter that has the packages of one extra, or "none": `EXTRA ARGUMENT ...`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

from gapbeam.process.extra_packages import EXTRAS

INSTALLED = sys.argv.pop(1)


class Installed(PathFinder):
    """Finds what is installed with that extra."""

    @classmethod
    def find_spec(
        cls, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module that belongs to no other extra."""
        extra = EXTRAS.get(name.partition(".")[0], INSTALLED)
        return super().find_spec(name, path, target) if extra == INSTALLED else None


sys.meta_path[sys.meta_path.index(PathFinder)] = Installed

from gapbeam.command_line import main  # noqa: E402 - from here on nothing absent can be imported

main()
