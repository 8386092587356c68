"""gapbeam: dynamic contact of beams and tubes in supports with play."""

from gapbeam.process.loading import leave_quietly_while_loading

leave_quietly_while_loading()  # before anything that takes long to load

from importlib import import_module  # noqa: E402
from typing import TYPE_CHECKING, Any  # noqa: E402

from gapbeam.process.process_environment import cache_by_default, home_by_default, signals_by_default  # noqa: E402
from gapbeam.process.thread_default import one_thread_by_default  # noqa: E402

home_by_default()  # before anything loads Open MPI
cache_by_default()  # before anything loads DOLFINx
signals_by_default()  # before anything loads PETSc
one_thread_by_default()  # before anything loads a numerical library

if TYPE_CHECKING:
    from gapbeam.interface.case_picture import view
    from gapbeam.interface.case_source import read_case
    from gapbeam.interface.case_studies import Workers, identify, life, stability, sweep, tradeoff
    from gapbeam.interface.error_classes import (
        AssumptionBroken,
        BrowserError,
        CaseError,
        ComparisonError,
        EnergyCreated,
        EnergyLost,
        Interrupted,
        IntervalNotMet,
        MeshError,
        NotConverged,
        NotFinite,
        NotWritten,
        OptionError,
        OutOfMemory,
        RangeNotCovered,
        RenderError,
        ResultsError,
        RunError,
        SignalError,
        UserError,
    )
    from gapbeam.interface.shown_results import compare, open_results, plot, render, report
    from gapbeam.interface.single_case import check, model, modes, run

    __version__: str

_MODULES = {
    "case_picture": ("view",),
    "case_source": ("read_case",),
    "single_case": ("check", "model", "modes", "run"),
    "case_studies": ("Workers", "identify", "life", "stability", "sweep", "tradeoff"),
    "shown_results": ("compare", "export", "open_results", "plot", "render", "report"),
}
"""Where each function is; a module is loaded when one of its names is first asked for. Error classes stand in one."""

__all__ = [
    "AssumptionBroken",
    "BrowserError",
    "CaseError",
    "ComparisonError",
    "EnergyCreated",
    "EnergyLost",
    "Interrupted",
    "IntervalNotMet",
    "MeshError",
    "NotConverged",
    "NotFinite",
    "NotWritten",
    "OptionError",
    "OutOfMemory",
    "RangeNotCovered",
    "RenderError",
    "ResultsError",
    "RunError",
    "SignalError",
    "UserError",
    "Workers",
    "__version__",
    "check",
    "compare",
    "export",
    "identify",
    "life",
    "model",
    "modes",
    "open_results",
    "plot",
    "read_case",
    "render",
    "report",
    "run",
    "stability",
    "sweep",
    "tradeoff",
    "view",
]


def __getattr__(name: str) -> Any:
    """Return a name of the interface, loaded now."""
    if name == "__version__":
        from importlib.metadata import version

        return version("gapbeam")
    if name in __all__:
        module = next((module for module, names in _MODULES.items() if name in names), "error_classes")
        found = getattr(import_module(f"gapbeam.interface.{module}"), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module 'gapbeam' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the names of the interface beside those that are loaded."""
    return sorted({*globals(), *__all__})
