"""A swept sine: a force at a point or an acceleration of the support whose frequency goes from one value to another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.point_load import HARMONICS
from gapbeam.solver.loads.step_force import PointOrSupportLoad
from gapbeam.solver.loads.time_function import SweptSine, TimeFunction
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, exceeds
from gapbeam.solver.schema.table import Name, Number, Positive, Switch

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
        if self.amplitude == 0.0:
            yield "amplitude = 0: it does nothing"
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
