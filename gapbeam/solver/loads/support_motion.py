"""What all motions of the support have in common.

What all motions of the walls of one support have in common.

Harmonic motion of one support: its walls move by q(t) - q(0), q = r(t) A sin(2 pi f t + phi), in m.

Recorded motion of one support: its walls move by q(t) - q(0), q from a file, in m.

Recorded motion of the support: f = -M e a_b(t) in the frame of the support, a_b from a file.

Harmonic motion of the support: f = -M e a_b(t) in the frame of the support.

a_b is the given acceleration, or the first or second derivative of the given velocity or displacement, ramp included.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from math import cos, pi, radians
from typing import ClassVar, Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.places import SupportAcceleration, SupportWalls
from gapbeam.solver.loads.point_load import HarmonicLoad
from gapbeam.solver.loads.recorded_function import signal_of
from gapbeam.solver.loads.recorded_load import RecordedLoad
from gapbeam.solver.loads.time_function import Harmonic, TimeFunction
from gapbeam.solver.table import Name, Number
from gapbeam.solver.wording.short_words import apart, exceeds


class MovingSupport(LoadTable):
    """A given motion of the walls of one support in the frame of all supports, counted from t = 0.

    Attributes:
        opens: Whether it changes the clearance, or moves the support as it is.
    """

    opens: ClassVar[bool] = False

    support: Name | None = Field(default=None, description="name of the support; default the only one")

    @property
    def place(self) -> SupportWalls:
        """The walls of the support."""
        return SupportWalls(self.support, self.opens)


HARDEST = 1.0e4  # m/s^2
SLOWEST = 1.0e-9  # share of the largest speed that is no jump


class HarmonicSupportMotion(HarmonicLoad, MovingSupport):
    """Harmonic displacement of one support while the others stay where they are."""

    type: Literal["support_motion"] = Field(description="kind of load")
    name: Name = Field(default="motion", description="name in results and messages, different for every load")
    amplitude: Number = Field(description="amplitude of the displacement, m", examples=[1.0e-4])

    def time_function(self) -> TimeFunction:
        """Return the displacement."""
        harmonic = Harmonic(self.amplitude, self.frequency, self.phase, self.ramp)
        return TimeFunction(harmonic.value, harmonic.mean, partial(harmonic.value, derivative=1))

    @property
    def peak(self) -> float:
        """A (2 pi f)^2, the largest acceleration of the support, m/s^2."""
        return abs(self.amplitude) * float((2.0 * pi * self.frequency) ** 2)

    @property
    def amplitude_unit(self) -> str:
        """Unit of the displacement."""
        return "m"

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that does nothing, or that looks like another unit."""
        yield from super().unusual_values()
        if self.peak > HARDEST:
            yield f"shakes a support with {self.peak:.3g} m/s^2, over 1000 g: is the amplitude in mm?"

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a motion whose speed starts with a jump, or that never reaches its amplitude."""
        if exceeds(self.ramp, end):
            yield "ramp = {} is longer than the run, {} s".format(*apart(self.ramp, end))
        jump = abs(cos(radians(self.phase)))
        if self.ramp == 0.0 and self.acts and jump > SLOWEST:
            speed = jump * abs(self.amplitude) * 2.0 * pi * self.frequency
            yield f"the support jumps to a speed of {speed:.3g} m/s at t = 0: give a ramp, or phase = 90.0"


class RecordedSupportMotion(RecordedLoad, MovingSupport):
    """Recorded displacement of one support while the others stay where they are, m after scaling."""

    type: Literal["recorded_support_motion"] = Field(description="kind of load")
    name: Name = Field(default="motion", description="name in results and messages, different for every load")

    def time_function(self) -> TimeFunction:
        """Return the displacement.

        Raises:
            RecordError: The file cannot be used.
        """
        signal = signal_of(self)
        return TimeFunction(signal.value, signal.mean, replace(signal, derivative=1).value)

    @property
    def derivatives(self) -> int:
        """Once: walls damp by their velocity."""
        return 1

    @property
    def peak(self) -> float:
        """Largest acceleration in the record, m/s^2."""
        return replace(signal_of(self), derivative=2).peak

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that looks like another unit, and what is odd in the record."""
        if self.peak > HARDEST:
            yield f"shakes a support with {self.peak:.3g} m/s^2, over 1000 g: are scale and time_scale right?"
        yield from super().unusual_values()


class SupportMotion(LoadTable):
    """Motion of the support; the equations are solved in the moving frame.

    Nothing is integrated in time: in the frame of the support only its acceleration acts.
    """

    hardest: ClassVar[float] = 1.0e4
    """Usual acceleration of a support, m/s^2."""

    quantity: Literal["acceleration", "velocity", "displacement"] = Field(
        default="acceleration", description="which quantity of the support it gives"
    )

    @property
    def place(self) -> SupportAcceleration:
        """All of the beam, in the frame of the support."""
        return SupportAcceleration()

    @property
    def derivative(self) -> int:
        """Which derivative of the quantity in time is the acceleration."""
        return ("acceleration", "velocity", "displacement").index(self.quantity)

    @property
    def quantity_unit(self) -> str:
        """Unit of the quantity."""
        return ("m/s^2", "m/s", "m")[self.derivative]


class RecordedMotion(RecordedLoad, SupportMotion):
    """Motion of the support that was recorded, m/s^2, m/s or m after scaling; solved in the moving frame."""

    type: Literal["recorded_motion"] = Field(description="kind of load")
    name: Name = Field(default="base", description="name in results and messages, different for every load")

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:
        """Yield an acceleration that does not exist at every row, and what is wrong with the record."""
        if self.quantity == "displacement" and self.interpolation == "monotone":
            yield Fault(
                (*key, "interpolation"),
                "monotone, of a displacement",
                "cubic: the second derivative of the others jumps at every row",
                'interpolation = "cubic"',
                ((*key, "quantity"),),
            )
        yield from super().faults_in_run(key, end, step)

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that looks like another unit, and what is odd in the record."""
        if self.peak > self.hardest:
            yield f"shakes the support with {self.peak:.3g} m/s^2, over 1000 g: are scale and time_scale right?"
        yield from super().unusual_values()


class BaseMotion(HarmonicLoad, SupportMotion):
    """Harmonic motion of the support; the equations are solved in the moving frame."""

    type: Literal["base_motion"] = Field(description="kind of load")
    name: Name = Field(default="base", description="name in results and messages, different for every load")
    amplitude: Number = Field(description="amplitude of the quantity, m/s^2, m/s or m", examples=[20.0])

    @property
    def amplitude_unit(self) -> str:
        """Unit of the quantity."""
        return self.quantity_unit

    def unusual_values(self) -> Iterator[str]:
        """Yield a motion that does nothing, or that looks like another unit."""
        yield from super().unusual_values()
        if self.peak > self.hardest:
            yield f"shakes the support with {self.peak:.3g} m/s^2, over 1000 g: is the amplitude in mm?"
