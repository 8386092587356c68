"""gapbeam: dynamic contact of beams and tubes in supports with play. Its names are in `__init__.pyi`."""

from gapbeam.process.loading import leave_quietly_while_loading

leave_quietly_while_loading()  # before anything that takes long to load

import sys  # noqa: E402
from functools import cache  # noqa: E402
from importlib import import_module  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

from gapbeam.process.extra_packages import find_extra_packages  # noqa: E402
from gapbeam.process.process_environment import (  # noqa: E402
    cache_by_default,
    home_by_default,
    leave_cores_by_default,
    one_thread_by_default,
    signals_by_default,
)

home_by_default()  # before anything loads Open MPI
leave_cores_by_default()
cache_by_default()  # before anything loads DOLFINx
signals_by_default()  # before anything loads PETSc
find_extra_packages()  # before anything imports one
one_thread_by_default()  # before anything loads a numerical library


@cache
def _modules() -> dict[str, str]:
    """Return the module of each public name."""
    import ast

    found = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    return {one.name: str(node.module) for node in found if isinstance(node, ast.ImportFrom) for one in node.names}


def __getattr__(name: str) -> Any:
    """Return a name of the interface, loaded now."""
    if name == "__version__":
        from importlib.metadata import version

        return version("gapbeam")
    if name == "__all__":
        return __dir__()
    if name.startswith("_") or name not in _modules():
        raise AttributeError(f"module 'gapbeam' has no attribute {name!r}", name=name, obj=sys.modules[__name__])
    globals()[name] = getattr(import_module(_modules()[name]), name)
    return globals()[name]


def __dir__() -> list[str]:
    """Return the names of the interface."""
    return sorted([*_modules(), "__version__"])
