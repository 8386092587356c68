"""A recorded force at a point: f = N(x_p)^T e s(t), s in N from a file."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.loads.point_load import PointLoad
from gapbeam.solver.loads.recorded_load import RecordedLoad


class RecordedForce(RecordedLoad, PointLoad):
    """A force at a point, recorded over time, N after scaling."""

    type: Literal["recorded_force"] = Field(description="kind of load")
