"""Forces at a point, f = N(x_p)^T e s(t) with s in N: harmonic with a smooth start, constant, or recorded.

A constant force acts at all times, from the seat on.

A modal exciter: a harmonic force at a point, with what its moving mass and suspension add to the beam.

What mass, spring and damper add to M, C and K is in `gapbeam.solver.assembly.assembled_system`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from math import pi, radians, sin
from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable, RampedLoad, StaticLoad
from gapbeam.solver.loads.places import Attachment, PointForce, StaticForce
from gapbeam.solver.loads.recorded_load import RecordedLoad
from gapbeam.solver.loads.time_function import Harmonic, TimeFunction, constant
from gapbeam.solver.schema.table import Name, NonNegative, Number, Positive, Vector

HARMONICS = 5.0
"""Multiples of the forcing frequency that are of interest."""


class HarmonicLoad(RampedLoad):
    """A harmonic load amplitude * sin(2 pi frequency t + phase), ramped smoothly from zero."""

    amplitude: Number = Field(description="amplitude, in the unit of the quantity", examples=[20.0])
    frequency: Positive = Field(description="forcing frequency, Hz", examples=[20.0])
    phase: Number = Field(default=0.0, description="phase at t = 0, degrees")
    ramp: NonNegative = Field(default=0.0, description="duration of the smooth start, s")
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, the bending direction"
    )

    def time_function(self) -> TimeFunction:
        """Return the ramped sine, or its derivative that is a force or an acceleration."""
        harmonic = Harmonic(self.amplitude, self.frequency, self.phase, self.ramp)
        return TimeFunction(
            partial(harmonic.value, derivative=self.derivative), partial(harmonic.mean, derivative=self.derivative)
        )

    @property
    def peak(self) -> float:
        """A (2 pi f)^derivative, N or m/s^2."""
        return abs(self.amplitude) * float((2.0 * pi * self.frequency) ** self.derivative)

    @property
    def forcing_frequency(self) -> float:
        """The frequency, Hz."""
        return self.frequency

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """Five times the frequency: contact makes harmonics."""
        return HARMONICS * self.frequency, f"{HARMONICS:g} times the highest forcing frequency"

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the frequency, and the steps in a period."""
        return f"{self.frequency:g} Hz", f"{1.0 / (self.frequency * step):.4g} steps per period"

    @property
    def amplitude_unit(self) -> str:
        """Unit of the amplitude."""
        return "N"

    @property
    def curve_units(self) -> Mapping[str, str]:
        """Units of frequency and amplitude."""
        return {"frequency": "Hz", "amplitude": self.amplitude_unit}

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a load that starts with a jump, or that never reaches its amplitude."""
        yield from super().unusual_in_run(end)
        if self.ramp == 0 and abs(sin(radians(self.phase))) > 1e-9:
            yield f"phase = {self.phase:g} without a ramp: the load starts with a jump"


class PointLoad(LoadTable):
    """A force at a point."""

    point: Number | Vector = Field(description="x on the axis, or all coordinates, m", examples=[0.15])

    @property
    def place(self) -> PointForce:
        """The point."""
        return PointForce(self.point)


class HarmonicPointForce(HarmonicLoad, PointLoad):
    """A harmonic force at a point, by itself or from a machine that is fixed to the beam."""

    amplitude: Number = Field(description="amplitude of the force, N", examples=[20.0])


class HarmonicForce(HarmonicPointForce):
    """A harmonic force at a point."""

    type: Literal["harmonic_force"] = Field(description="kind of load")
    name: Name = Field(default="force", description="unique name")


class ConstantForce(StaticLoad, PointLoad):
    """A constant force at a point, part of the static seat."""

    type: Literal["constant_force"] = Field(description="kind of load")
    name: Name = Field(default="force", description="unique name")
    amplitude: Number = Field(description="the force along the direction, N", examples=[20.0])
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, the bending direction"
    )

    def time_function(self) -> TimeFunction:
        """Return s(t) = amplitude."""
        return constant(self.amplitude)

    @property
    def peak(self) -> float:
        """The size of the force, N."""
        return abs(self.amplitude)


class RecordedForce(RecordedLoad, PointLoad):
    """A force at a point, recorded over time, N after scaling."""

    type: Literal["recorded_force"] = Field(description="kind of load")


UNITS = {"mass": "kg", "stiffness": "N/m", "damping": "N s/m", "preload": "N"}


class Exciter(HarmonicPointForce):
    """A harmonic force from a modal exciter: a mass on a spring and a damper, fixed to the beam.

    The suspension stands on the frame of the support and carries the weight of the moving mass: gravity does not act on
    it, base motion does. It is relaxed in the undeformed pose of the beam, except for the preload.
    """

    may_rest: ClassVar[bool] = True

    type: Literal["exciter"] = Field(description="kind of load")
    name: Name = Field(default="exciter", description="unique name")
    mass: NonNegative = Field(default=0.0, description="moving mass, which follows the beam, kg", examples=[0.1])
    stiffness: NonNegative = Field(
        default=0.0, description="stiffness of the suspension along the direction, N/m", examples=[1.0e4]
    )
    damping: NonNegative = Field(
        default=0.0, description="damping of the suspension along the direction, N s/m", examples=[2.0]
    )
    preload: Number = Field(
        default=0.0, description="static force on the beam along the direction, also in the seat, N", examples=[-5.0]
    )

    @property
    def attachment(self) -> Attachment:
        """Its moving mass on its suspension."""
        return Attachment(self.mass, self.stiffness, self.damping)

    @property
    def static_force(self) -> StaticForce | None:
        """The preload, where there is one."""
        return StaticForce(f"{self.name} preload", self.preload) if self.preload != 0.0 else None

    @property
    def curve_units(self) -> Mapping[str, str]:
        """Units of frequency, amplitude, and of the mass, spring or damper that it adds to the beam."""
        return {**super().curve_units, **UNITS}

    @property
    def acts(self) -> bool:
        """True where the exciter has a force, a preload, or anything attached to the beam."""
        return super().acts or self.attachment.acts or self.preload != 0.0
