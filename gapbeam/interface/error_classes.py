"""The errors that functions of a Python session raise; each has the `exit_status` that the command line ends with."""

from __future__ import annotations

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.postprocess.render import RenderError
from gapbeam.postprocess.report.pdf_page import BrowserError
from gapbeam.postprocess.results_errors import OptionError, ResultsError
from gapbeam.postprocess.run_comparison import ComparisonError
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.solver.messages.errors import (
    AssumptionBroken,
    CaseError,
    EnergyCreated,
    EnergyLost,
    Interrupted,
    IntervalNotMet,
    NotConverged,
    NotFinite,
    NotWritten,
    OutOfMemory,
    RangeNotCovered,
    RunError,
    UserError,
)

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
]
