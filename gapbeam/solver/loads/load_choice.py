"""The choice of loads: the tables [[load]] of a case, distinguished by their `type`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gapbeam.solver.loads.base_motion import BaseMotion
from gapbeam.solver.loads.clearance_change import ClearanceChange
from gapbeam.solver.loads.constant_force import ConstantForce
from gapbeam.solver.loads.exciter import Exciter
from gapbeam.solver.loads.gravity import Gravity
from gapbeam.solver.loads.harmonic_force import HarmonicForce
from gapbeam.solver.loads.harmonic_support_motion import HarmonicSupportMotion
from gapbeam.solver.loads.random_line_load import RandomLineLoad
from gapbeam.solver.loads.random_load import RandomLoad
from gapbeam.solver.loads.recorded_force import RecordedForce
from gapbeam.solver.loads.recorded_motion import RecordedMotion
from gapbeam.solver.loads.recorded_support_motion import RecordedSupportMotion
from gapbeam.solver.loads.step_force import StepForce
from gapbeam.solver.loads.swept_sine import SweptSineLoad

Load = Annotated[
    Gravity
    | HarmonicForce
    | ConstantForce
    | StepForce
    | Exciter
    | BaseMotion
    | RandomLoad
    | RandomLineLoad
    | SweptSineLoad
    | RecordedForce
    | RecordedMotion
    | HarmonicSupportMotion
    | RecordedSupportMotion
    | ClearanceChange,
    Field(discriminator="type"),
]

NO_LOADS: tuple[Load, ...] = ()
