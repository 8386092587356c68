"""What loads have in common that never repeat and may start smoothly."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Self

from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.table import NonNegative, Vector
from gapbeam.solver.wording.compared_numbers import apart, exceeds


class UnrepeatedLoad(LoadTable):
    """A load that never repeats, with a smooth start."""

    ramp: NonNegative = Field(default=0.0, description="time over which it rises smoothly from 0, s")
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, the bending direction"
    )

    @property
    @abstractmethod
    def unit(self) -> str:
        """Unit of what the function of time is."""

    @property
    def forcing_frequency(self) -> None:
        """None: it never repeats."""

    @property
    def rise_time(self) -> float:
        """Duration of the ramp, s."""
        return self.ramp

    def at_full_amplitude(self) -> Self:
        """Return the load without its ramp."""
        return self.model_copy(update={"ramp": 0.0})

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a smooth start that is longer than the run."""
        if exceeds(self.ramp, end):
            yield "ramp = {} is longer than the run, {} s".format(*apart(self.ramp, end))
