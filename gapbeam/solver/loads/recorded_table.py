"""The keys that all recorded loads have in common: the file of a measured signal, and how it is read."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict

from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.table import Name, NonNegative, Number, Positive, Switch, Vector

Column = Annotated[int, Strict(), Field(ge=1, le=10_000)] | Annotated[str, Field(min_length=1, max_length=100)]


Holes = Literal["refuse", "linear", "spline", "zero"]


class RecordedTable(LoadTable):
    """A load recorded over time: scale * (value - mean) + offset, with a curve between the rows."""

    name: Name = Field(default="recorded", description="name in results and messages, different for every load")
    file: str = Field(
        min_length=1,
        description="a text file with a row for each time, its path relative to the case file",
        examples=["signals/shaker.csv"],
    )
    time_column: Column = Field(
        default=1, description="column of the times: its number from 1, or its name in the line above the rows"
    )
    value_column: Column = Field(
        default=2, description="column of the values: its number from 1, or its name in the line above the rows"
    )
    time_scale: Positive = Field(
        default=1.0, description="what the times of the file are multiplied by, 1e-3 for ms, no unit"
    )
    scale: Number = Field(default=1.0, description="what the values of the file are multiplied by, 9.81 for g, no unit")
    offset: Number = Field(
        default=0.0, description="what is added to the scaled values, N or, for motion, m/s^2, m/s or m"
    )
    remove_mean: Switch = Field(default=False, description="take the mean over the record off its values")
    start: Number | None = Field(
        default=None, description="time of the record at which the run starts, s; default that of its first row"
    )
    ramp: NonNegative = Field(default=0.0, description="duration of the smooth start, s")
    beyond: Literal["refuse", "zero", "repeat"] = Field(
        default="refuse",
        description="what acts before the first row and after the last: nothing, since the record must cover the run; "
        "zero; or the record again, whose last row is then the first of the next round",
    )
    interpolation: Literal["cubic", "monotone"] = Field(
        default="cubic",
        description="curve between the rows: a cubic spline, or piecewise cubics without overshoot, for pulses and "
        "jumps",
    )
    holes: Holes = Field(
        default="refuse",
        description="what acts where rows are more than three median intervals apart: nothing, since a record has no "
        "such holes; a straight line; the curve of `interpolation`; or 0 in the file",
    )
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, toward the gland"
    )
    checksum: str | None = Field(
        default=None,
        min_length=64,
        max_length=64,
        description="SHA-256 that the file must have; results write it into their case; default any",
    )

    @property
    def derivatives(self) -> int:
        """How often what the file holds is differentiated in time."""
        return self.derivative
