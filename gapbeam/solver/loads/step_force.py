"""Forces at a point that are switched on, f = N(x_p)^T e s(t), and the base of loads that never repeat.

    s(t) = F (r(t - start) - r(t - end))

r is the smooth start of `gapbeam.solver.loads.time_function`, or a step from 0 to 1 without a ramp.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.load_table import RampedLoad
from gapbeam.solver.loads.places import PointForce, SupportAcceleration
from gapbeam.solver.loads.point_load import HARMONICS, PointLoad
from gapbeam.solver.loads.time_function import SweptSine, TimeFunction, piecewise_mean, ramps_at
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, exceeds
from gapbeam.solver.schema.table import Name, NonNegative, Number, Positive, Switch, Vector
from gapbeam.solver.system.operators import Array


class UnrepeatedLoad(RampedLoad):
    """A load that never repeats, with a smooth start."""

    forcing_frequency: ClassVar[None] = None  # it never repeats

    ramp: NonNegative = Field(default=0.0, description="duration of the smooth start, s")
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, the bending direction"
    )

    @property
    @abstractmethod
    def unit(self) -> str:
        """Unit of the function of time."""


FASTEST = 2.0
"""Frequencies beyond this many per ramp hold next to nothing of it."""


class StepForce(UnrepeatedLoad, PointLoad):
    """A force at a point from a time on, or between two times; no part of the static seat."""

    unit: ClassVar[str] = "N"
    settles: ClassVar[bool] = True

    type: Literal["step_force"] = Field(description="kind of load")
    name: Name = Field(default="force", description="unique name")
    amplitude: Number = Field(description="the force along the direction once it has risen, N", examples=[20.0])
    start: NonNegative = Field(default=0.0, description="time at which it begins to rise, s")
    end: Positive | None = Field(
        default=None, description="time at which it begins to fall to 0, over the ramp again, s; default never"
    )
    ramp: NonNegative = Field(default=0.0, description="time over which it rises smoothly, s; 0: it jumps")

    def time_function(self) -> TimeFunction:
        """Return the force, with its exact mean."""
        knots = [edge + late for edge in self._edges for late in (0.0, self.ramp)]

        def mean(starts: Array, ends: Array) -> Array:
            return piecewise_mean(self._force, np.array(knots), starts, ends)

        return TimeFunction(self._force, mean, jumps=self.ramp == 0.0)

    @property
    def _edges(self) -> tuple[float, ...]:
        return (self.start,) if self.end is None else (self.start, self.end)

    def _force(self, time: Any) -> Any:
        """Return s at a time, or at each of an array of times, N."""
        risen = [np.where(np.asarray(time) >= edge, self._risen(time - edge), 0.0) for edge in self._edges]
        total = self.amplitude * (risen[0] - sum(risen[1:]))
        return total if isinstance(time, np.ndarray) else float(total)

    def _risen(self, since: Any) -> Any:
        return 1.0 if self.ramp == 0.0 else ramps_at(np.maximum(since, 0.0), self.ramp)[0]

    @property
    def peak(self) -> float:
        """The size of the force, N."""
        return abs(self.amplitude)

    @property
    def frequency_of_interest(self) -> tuple[float, str] | None:
        """Two over the ramp, or over a pulse without one; a jump that stays has all frequencies, and asks for none."""
        if self._shortest is None:
            return None
        part = "ramp" if self.ramp > 0.0 else "length"
        return FASTEST / self._shortest, f"{FASTEST:g} over the {part} of the load {self.name}"

    @property
    def _shortest(self) -> float | None:
        """Duration of the ramp or, without one, of the pulse, s; None: a jump that stays."""
        return self.ramp or (self.end - self.start if self.end is not None and self.end > self.start else None)

    @property
    def rise_time(self) -> float:
        """Time at which the force has risen, s."""
        return self.start + self.ramp

    def at_full_amplitude(self) -> Self:
        """Return the force that acts from the begin on."""
        return self.model_copy(update={"start": 0.0, "ramp": 0.0, "end": None})

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the time of the rise, and the steps of its ramp."""
        rise = f"over {self.ramp / step:.4g} steps" if self.ramp > 0.0 else "a jump"
        return f"at {self.start:g} s", rise

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield an end at or before the start, or before the force has risen."""
        if self.end is not None and (not exceeds(self.end, self.start) or exceeds(self.rise_time, self.end)):
            (end, start), rise = apart(self.end, self.start), apart(self.end, self.rise_time)[1]
            yield Fault(
                (*key, "end"),
                f"{end} s; the force rises {f'at {start}' if self.ramp == 0.0 else f'from {start} to {rise}'} s",
                "a time after the start at which the force has risen: start + ramp, or later",
                f"end = {self.start + max(2.0 * self.ramp, self.end):.6g}, or leave end out: the force then stays",
                ((*key, "start"), (*key, "ramp")),
            )

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a force that does not rise within the run."""
        if not exceeds(end, self.start):
            yield "start = {} is not within the run, {} s: it does nothing".format(*apart(self.start, end))
        elif exceeds(self.rise_time, end):
            yield "start + ramp = {} is later than the end of the run, {} s".format(*apart(self.rise_time, end))

    def unusual_steps(self, step: float) -> Iterator[str]:
        """Yield a warning of a step that is longer than the ramp or the pulse."""
        if (shortest := self._shortest) is not None and exceeds(step, shortest):
            part, jumps = ("ramp", "jumps") if self.ramp > 0.0 else ("pulse", "jumps and falls")
            yield f"longer than the {part} of {apart(step, shortest)[1]} s: the force {jumps} within a step"


class PointOrSupportLoad(UnrepeatedLoad):
    """A force at a point or an acceleration of the support, with a smooth start; it never repeats."""

    quantity: Literal["force", "acceleration"] = Field(
        default="force", description="quantity: a force at a point, or the acceleration of the support"
    )
    point: Number | Vector | None = Field(
        default=None,
        description="of a force: x on the axis, or all coordinates, m",
        examples=[0.15],
    )

    @property
    def place(self) -> PointForce | SupportAcceleration:
        """The point, or all of the beam in the frame of the support."""
        return SupportAcceleration() if self.point is None else PointForce(self.point)

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return "N" if self.quantity == "force" else "m/s^2"

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield a force at no point, and an acceleration at one."""
        if self.quantity == "force" and self.point is None:
            yield Fault(
                (*key, "point"),
                "missing, of a force",
                "where the force acts: x on the axis, or all coordinates, m",
                'point = 0.15, or quantity = "acceleration" to shake the support',
                ((*key, "quantity"),),
            )
        if self.quantity == "acceleration" and self.point is not None:
            yield Fault(
                (*key, "point"),
                "a point, of an acceleration",
                "no point: an acceleration moves the support, with all that stands on it",
                'leave point out, or quantity = "force"',
                ((*key, "quantity"),),
            )


FEW, ENOUGH = 20, 50  # steps in a period
RECORDS = 10.0  # in a period that records show
FEWEST_CYCLES = 10.0  # in a sweep


class SweptSineLoad(PointOrSupportLoad):
    """A sine of constant amplitude whose frequency changes, up or down, and back if asked."""

    type: Literal["swept-sine"] = Field(description="kind of load")
    name: Name = Field(default="sweep", description="unique name")
    amplitude: Number = Field(description="amplitude, N or m/s^2", examples=[20.0])
    start_frequency: Positive = Field(description="frequency at t = 0, Hz", examples=[5.0])
    end_frequency: Positive = Field(
        description="frequency at the end of the sweep, Hz",
        examples=[100.0],
    )
    duration: Positive = Field(description="duration of the sweep, s", examples=[20.0])
    spacing: Literal["logarithmic", "linear"] = Field(
        default="logarithmic", description="the frequency changes by the same factor, or difference, in equal times"
    )
    back: Switch = Field(default=False, description="go back to start_frequency in the same time")
    after: Literal["hold", "stop"] = Field(
        default="hold",
        description="after the sweep: its last frequency, or nothing, to which it falls over the last `ramp`",
    )

    @property
    def signal(self) -> SweptSine:
        """The sine as a function of time."""
        return SweptSine(
            self.amplitude,
            self.start_frequency,
            self.end_frequency,
            self.duration,
            self.spacing,
            self.back,
            self.after,
            self.ramp,
        )

    def time_function(self) -> TimeFunction:
        """Return the swept sine."""
        return TimeFunction(self.signal.value, self.signal.mean)

    @property
    def peak(self) -> float:
        """The amplitude, N or m/s^2."""
        return abs(self.amplitude)

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """Five times the highest frequency: contact makes harmonics."""
        return HARMONICS * self.signal.highest, f"{HARMONICS:g} times the highest frequency of the load {self.name}"

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the first and the last frequency, and the steps in the shortest period."""
        frequencies = f"{self.start_frequency:g} to {self.end_frequency:g} Hz{' and back' if self.back else ''}"
        return (
            frequencies,
            f"at least {1.0 / (self.signal.highest * step):.4g} steps per period, in {self.signal.end:g} s",
        )

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield faults: a sweep without a range, ramps that overlap."""
        yield from super().faults(key)
        if self.start_frequency == self.end_frequency:
            yield Fault(
                (*key, "end_frequency"),
                f"{self.end_frequency:g} Hz, as start_frequency",
                "another frequency: nothing is swept",
                'type = "harmonic_force" or "base_motion" has one frequency',
                ((*key, "start_frequency"),),
            )
        if self.after == "stop" and exceeds(2.0 * self.ramp, self.signal.end):
            half = apart(self.ramp, 0.5 * self.signal.end)
            yield Fault(
                (*key, "ramp"),
                f'{half[0]} s, at both ends of a sweep with after = "stop"',
                f"at most half the sweep, {half[1]} s",
                f"ramp = {0.1 * self.signal.end:g}",
                ((*key, "duration"),),
            )

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:
        """Yield a step that is too long for the highest frequency."""
        yield from super().faults_in_run(key, end, step)
        highest = self.signal.highest
        if step is not None and step >= 0.5 / highest:
            found, half = apart(step, 0.5 / highest)
            name = "end_frequency" if self.end_frequency > self.start_frequency else "start_frequency"
            yield Fault(
                ("time", "step"),
                f"{found} s, with a sine of up to {highest:g} Hz",
                f"far less than {half} s, half its period; {ENOUGH} steps in it are good",
                f"step = {1.0 / (ENOUGH * highest):.3g}",
                ((*key, name),),
            )

    def unusual_values(self) -> Iterator[str]:
        """Yield a load that does nothing, too few cycles, and a jump at the end."""
        yield from super().unusual_values()
        cycles = 0.5 * (self.start_frequency + self.end_frequency) * self.duration
        if cycles < FEWEST_CYCLES:
            yield f"goes through about {cycles:.3g} cycles on its way: too few for a frequency to show"
        if self.after == "stop" and self.ramp == 0.0:
            yield 'after = "stop" without a ramp: the load ends with a jump'

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a sweep that the run ends before."""
        yield from super().unusual_in_run(end)
        if exceeds(self.signal.end, end):
            whole, run = apart(self.signal.end, end)
            reached = float(self.signal.frequency(np.array([end]))[0])
            yield (
                f"takes {whole} s, longer than the run of {run} s, which ends at {reached:.4g} Hz; "
                f"time.end = {whole} shows all of it"
            )

    def unusual_steps(self, step: float) -> Iterator[str]:
        """Yield a step that is too long for the highest frequency."""
        highest = self.signal.highest
        if step * highest > 1.0 / FEW:
            count = 1.0 / (highest * step)
            yield f"{count:.3g} steps in a period of {highest:g} Hz of the load {self.name}, and {ENOUGH} are good"

    def unusual_records(self, interval: float) -> Iterator[str]:
        """Yield records that are too far apart to show the highest frequency."""
        highest = self.signal.highest
        if interval * highest > 1.0 / RECORDS:
            count = 1.0 / (highest * interval)
            yield f"keeps {count:.3g} records in a period of {highest:g} Hz of the load {self.name}"
