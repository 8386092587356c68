"""Motions of supports: of all of them together, of the walls of one support, and of a clearance.

Base motion is the load f = -M e a_b(t) in the frame of the support, where a_b is the given acceleration, or the first
or second derivative of the given velocity or displacement, ramp included. Walls of one support move by q(t) - q(0), in
m, with q = r(t) A sin(2 pi f t + phi) or from a file. A clearance changes by a table, as in thermal closure or a
release,

    c(t) = clearance + x(t).

x is the curve through the rows of a table: piecewise cubics that keep the rows monotone, at rest in the first and in
the last row, and constant after it. It overshoots no row, so that no closure is deeper than the table says; its speed
is continuous, so that a wall in contact strikes no blow where the table has a row. A curve of straight lines would.

Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import cos, pi, radians
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import scipy
from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable, RampedLoad
from gapbeam.solver.loads.places import SupportAcceleration, SupportWalls
from gapbeam.solver.loads.point_load import HarmonicLoad
from gapbeam.solver.loads.recorded_function import signal_of
from gapbeam.solver.loads.recorded_load import RecordedLoad
from gapbeam.solver.loads.time_function import Harmonic, TimeFunction, smooth
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.schema.record_table import OF_MOTIONS
from gapbeam.solver.schema.table import Name, NonNegative, Number


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


SLOWEST = 1.0e-9  # share of the largest speed that is no jump


class HarmonicSupportMotion(HarmonicLoad, MovingSupport):
    """Harmonic displacement of one support."""

    amplitude_unit: ClassVar[str] = "m"

    type: Literal["support_motion"] = Field(description="kind of load")
    name: Name = Field(default="motion", description="unique name")
    amplitude: Number = Field(description="amplitude of the displacement, m", examples=[1.0e-4])

    def time_function(self) -> TimeFunction:
        """Return the displacement."""
        harmonic = Harmonic(self.amplitude, self.frequency, self.phase, self.ramp)
        value = harmonic.value
        return TimeFunction(value, harmonic.mean, partial(value, derivative=1), partial(value, derivative=2))

    @property
    def peak(self) -> float:
        """A (2 pi f)^2, the largest acceleration of the support, m/s^2."""
        return abs(self.amplitude) * float((2.0 * pi * self.frequency) ** 2)

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a motion whose speed starts with a jump, or that never reaches its amplitude."""
        yield from RampedLoad.unusual_in_run(self, end)
        jump = abs(cos(radians(self.phase)))
        if self.ramp == 0.0 and self.acts and jump > SLOWEST:
            speed = jump * abs(self.amplitude) * 2.0 * pi * self.frequency
            yield f"the support jumps to a speed of {speed:.3g} m/s at t = 0: give a ramp, or phase = 90.0"


class RecordedSupportMotion(RecordedLoad, MovingSupport):
    """Recorded displacement of one support, m after scaling."""

    derivatives: ClassVar[int] = 1  # walls damp by their velocity

    type: Literal["recorded_support_motion"] = Field(description="kind of load")
    name: Name = Field(default="motion", description="unique name")

    def time_function(self) -> TimeFunction:
        """Return the displacement.

        Raises:
            RecordError: The file cannot be used.
        """
        signal = signal_of(self)
        rate, acceleration = (replace(signal, derivative=k).value for k in (1, 2))
        return TimeFunction(signal.value, signal.mean, rate, acceleration)

    @property
    def peak(self) -> float:
        """Largest acceleration in the record, m/s^2."""
        return replace(signal_of(self), derivative=2).peak


class SupportMotion(LoadTable):
    """Motion of the support; the equations are solved in the moving frame.

    Nothing is integrated in time: in the frame of the support only its acceleration acts.
    """

    place: ClassVar[SupportAcceleration] = SupportAcceleration()

    quantity: Literal["acceleration", "velocity", "displacement"] = Field(
        default="acceleration", description="quantity of the support's motion"
    )

    @property
    def derivative(self) -> int:
        """Order of the time derivative of the quantity that the acceleration is."""
        return list(OF_MOTIONS).index(self.quantity)


class RecordedMotion(RecordedLoad, SupportMotion):
    """Motion of the support that was recorded, m/s^2, m/s or m after scaling; solved in the moving frame."""

    type: Literal["recorded_motion"] = Field(description="kind of load")
    name: Name = Field(default="base", description="unique name")

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:
        """Yield an acceleration that does not exist at every row, and faults of the record."""
        if self.quantity == "displacement" and self.interpolation == "monotone":
            yield Fault(
                (*key, "interpolation"),
                "monotone, of a displacement",
                "cubic: the second derivative of the others jumps at every row",
                'interpolation = "cubic"',
                ((*key, "quantity"),),
            )
        yield from super().faults_in_run(key, end, step)


class BaseMotion(HarmonicLoad, SupportMotion):
    """Harmonic motion of the support; the equations are solved in the moving frame."""

    type: Literal["base_motion"] = Field(description="kind of load")
    name: Name = Field(default="base", description="unique name")
    amplitude: Number = Field(description="amplitude of the quantity, m/s^2, m/s or m", examples=[20.0])

    @property
    def amplitude_unit(self) -> str:
        """Unit of the quantity."""
        return OF_MOTIONS[self.quantity]


MOST = 10_000  # rows


class ClearanceChange(MovingSupport):
    """A clearance that follows a table over time."""

    direction: ClassVar[None] = None  # it opens and closes on all sides
    peak: ClassVar[float] = 0.0  # the force of a closure follows from stiffness, and not from an acceleration
    forcing_frequency: ClassVar[None] = None  # it never repeats
    rise_time: ClassVar[float] = 0.0  # it begins at once
    opens: ClassVar[bool] = True

    type: Literal["clearance_change"] = Field(description="kind of load")
    name: Name = Field(default="closure", description="unique name")
    times: Annotated[tuple[NonNegative, ...], Field(min_length=2, max_length=MOST)] = Field(
        description="times in ascending order, the first one 0, s", examples=[[0.0, 0.1, 0.2]]
    )
    changes: Annotated[tuple[Number, ...], Field(min_length=2, max_length=MOST)] = Field(
        description="change of the clearance at each of them, the first 0; negative closes it; smooth in "
        "between, constant after the last, m",
        examples=[[0.0, -5.0e-5, -1.0e-4]],
    )

    def time_function(self) -> TimeFunction:
        """Return x(t)."""
        times, changes, last = np.array(self.times), np.array(self.changes), self.times[-1]
        slopes = scipy.interpolate.PchipInterpolator(times, changes).derivative()(times)
        slopes[[0, -1]] = 0.0
        curve = scipy.interpolate.CubicHermiteSpline(times, changes, slopes)

        def value(time: Any) -> Any:
            return curve(np.minimum(time, last))

        def rate(time: Any) -> Any:
            return np.where(np.asarray(time) < last, curve(np.minimum(time, last), nu=1), 0.0)

        return smooth(value, rate)

    @property
    def travel(self) -> tuple[float, float]:
        """Least and largest change: no row is overshot."""
        return min(self.changes), max(self.changes)

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """Half of one over the shortest time between two rows, Hz."""
        return 0.5 / self._shortest, f"that of a half-wave between two rows of {self.name}"

    def at_full_amplitude(self) -> Self:
        """Return the change itself."""
        return self

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the duration of the change, and the steps between its closest rows."""
        return f"over {self.times[-1]:.4g} s", f"{self._shortest / step:.4g} steps between its closest rows"

    @property
    def _shortest(self) -> float:
        return min(later - earlier for earlier, later in pairwise(self.times))

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield times that do not ascend from 0, changes that do not begin with 0, and another number of them."""
        times, changes = self.times, self.changes
        if times[0] != 0.0:
            hint = "the clearance of the support is that at t = 0"
            yield Fault((*key, "times"), f"a first time of {times[0]:g} s", "0.0, where the run starts", hint)
        for number, (earlier, later) in enumerate(pairwise(times)):
            if later <= earlier:
                yield Fault(
                    (*key, "times"),
                    f"{later:g} s after {earlier:g} s, in place {number + 2}",
                    "times in ascending order",
                    "a jump is two times that are close to each other",
                )
                break
        if len(times) != len(changes):
            yield Fault(
                (*key, "changes"),
                f"{len(changes)} for {len(times)} times",
                "one change for each time",
                related=((*key, "times"),),
            )
        elif changes[0] != 0.0:
            yield Fault(
                (*key, "changes"),
                f"{changes[0]:g} m at t = 0",
                "0.0: the clearance of the support is that at t = 0",
                f"take {changes[0]:g} m off all of them, and add it to the clearance",
            )

    def unusual_values(self) -> Iterator[str]:
        """Yield a change that does nothing."""
        if not any(self.changes):
            yield "changes are all 0: it does nothing"

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a change that does not end in the run."""
        if self.times[-1] > end:
            yield f"goes on until {self.times[-1]:g} s, after the end of the run, {end:g} s"

    def unusual_steps(self, step: float) -> Iterator[str]:
        """Yield a step that is longer than the time between two rows."""
        if step > self._shortest:
            yield f"{self._shortest / step:.2g} steps between two rows of {self.name}"
