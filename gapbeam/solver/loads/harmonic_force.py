"""A harmonic force at a point: f = N(x_p)^T e s(t), s in N."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gapbeam.solver.loads.harmonic_load import HarmonicLoad
from gapbeam.solver.loads.point_load import PointLoad
from gapbeam.solver.table import Name, Number


class HarmonicPointForce(HarmonicLoad, PointLoad):
    """A harmonic force at a point, by itself or from a machine that is fixed to the beam."""

    amplitude: Number = Field(description="amplitude of the force, N", examples=[20.0])


class HarmonicForce(HarmonicPointForce):
    """A harmonic force at a point."""

    type: Literal["harmonic_force"] = Field(description="kind of load")
    name: Name = Field(default="force", description="name in results and messages, different for every load")
