"""Recorded motion of the support: f = -M e a_b(t) in the frame of the support, a_b from a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.recorded_load import RecordedLoad
from gapbeam.solver.loads.support_motion import SupportMotion
from gapbeam.solver.table import Name


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
