"""Files that stand in front of those of the package, as if somebody had written them there."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType


class Overlay(MetaPathFinder):
    """Finds modules in a folder, before anything else is asked for them.

    Args:
        folder: A folder with files at their places, such as gapbeam/solver/integrators/scheme_choice.py.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where a module lies in the folder; None where the folder does not have it."""
        file = self.folder.joinpath(*name.split(".")).with_suffix(".py")
        return spec_from_file_location(name, file) if file.is_file() else None

    def lay(self) -> None:
        """Stand in front of all other finders; call it before the modules are imported."""
        sys.meta_path.insert(0, self)
