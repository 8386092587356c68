"""A clearance that changes in time: thermal closure, a release that opens.

    c(t) = clearance + x(t)

x is the curve through the rows of a table: piecewise cubics that keep the rows monotone, at rest in the first and in
the last row, and constant after it. It overshoots no row, so that no closure is deeper than the table says; its speed
is continuous, so that a wall in contact strikes no blow where the table has a row. A curve of straight lines would.

Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator, PPoly

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.support_motion import MovingSupport
from gapbeam.solver.loads.time_function import TimeFunction, smooth
from gapbeam.solver.table import Name, NonNegative, Number

MOST = 10_000  # rows


class ClearanceChange(MovingSupport):
    """A clearance that follows a table over time."""

    opens: ClassVar[bool] = True

    type: Literal["clearance_change"] = Field(description="kind of load")
    name: Name = Field(default="closure", description="name in results and messages, different for every load")
    times: Annotated[tuple[NonNegative, ...], Field(min_length=2, max_length=MOST)] = Field(
        description="times in ascending order, the first one 0, s", examples=[[0.0, 0.1, 0.2]]
    )
    changes: Annotated[tuple[Number, ...], Field(min_length=2, max_length=MOST)] = Field(
        description="what is added to the clearance of the support at each of them, the first one 0; negative closes "
        "it; a smooth curve in between, constant after the last, m",
        examples=[[0.0, -5.0e-5, -1.0e-4]],
    )

    @property
    def direction(self) -> None:
        """None: it opens and closes on all sides."""

    @cached_property
    def curve(self) -> PPoly:
        """The curve x, m over s."""
        times, changes = np.array(self.times), np.array(self.changes)
        slopes = PchipInterpolator(times, changes).derivative()(times)
        slopes[[0, -1]] = 0.0
        return CubicHermiteSpline(times, changes, slopes)

    def time_function(self) -> TimeFunction:
        """Return x(t)."""
        curve, last = self.curve, self.times[-1]

        def value(time: Any) -> Any:
            return curve(np.minimum(time, last))

        def rate(time: Any) -> Any:
            return np.where(np.asarray(time) < last, curve(np.minimum(time, last), nu=1), 0.0)

        return smooth(value, rate)

    @property
    def peak(self) -> float:
        """0: what a closure presses with follows from stiffness, and not from an acceleration."""
        return 0.0

    @property
    def travel(self) -> tuple[float, float]:
        """Least and largest change: no row is overshot."""
        return min(self.changes), max(self.changes)

    @property
    def forcing_frequency(self) -> None:
        """None: it never repeats."""

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """Half of one over the shortest time between two rows, Hz."""
        return 0.5 / self._shortest, f"that of a half-wave between two rows of {self.name}"

    @property
    def rise_time(self) -> float:
        """0: it begins at once."""
        return 0.0

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
