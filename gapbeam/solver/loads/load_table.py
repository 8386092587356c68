"""Base of all loads: traits that models, checks, time steps, starts and studies ask for, and keys of recorded loads.

The rest of the code reads these traits and never asks which load it is. A trait without a value that fits every load is
abstract: a load that leaves it out cannot be made.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, Strict, TypeAdapter

from gapbeam.solver.loads.places import (
    Attachment,
    BodyForce,
    LoadPart,
    Place,
    StaticForce,
    SupportAcceleration,
    SupportWalls,
)
from gapbeam.solver.loads.time_function import TimeFunction, constant
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, exceeds
from gapbeam.solver.schema.record_table import STANDARD_GRAVITY
from gapbeam.solver.schema.table import Name, NonNegative, Number, Positive, Switch, Table, Vector

OF_MODEL = ("type", "name", "direction")
"""Keys that a model depends on beside those of the place."""
HARDEST = 0.015
"""Speed over wave speed, the strain of an impact, up to which shaking is usual."""


class LoadTable(Table, ABC):
    """A load of a case: a direction at a place times a function of time s.

    Attributes:
        static: Whether it is constant and part of the seat; it then does not drive the motion.
        settles: Whether it ends at a constant: what it excites rings freely from then on.
        alone: Whether a case has at most one load of its type.
        noise: Whether it is random for ever, so that a run is known by its statistics.
        of_model: Keys that a model depends on, beside those that change the place.
        default_sense: Sense along the bending axis without a direction: 1.0 up, -1.0 down.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {
        "value": "a load has an `amplitude` or a `spectrum`, gravity an `acceleration`"
    }
    static: ClassVar[bool] = False
    settles: ClassVar[bool] = False
    alone: ClassVar[bool] = False
    noise: ClassVar[bool] = False
    of_model: ClassVar[tuple[str, ...]] = OF_MODEL
    default_sense: ClassVar[float] = 1.0

    @property
    @abstractmethod
    def place(self) -> Place:
        """Place where the load acts."""

    @abstractmethod
    def time_function(self) -> TimeFunction:
        """Return s(t): a force, N, an acceleration, m/s^2, or with its rate the motion of walls, m.

        Raises:
            UserError: A file that it is read from cannot be used.
        """

    @property
    @abstractmethod
    def peak(self) -> float:
        """Largest |s|, N or m/s^2, without the smooth start; of the motion of walls the largest acceleration."""

    @property
    @abstractmethod
    def forcing_frequency(self) -> float | None:
        """Frequency at which s repeats, Hz, once it has started; None for loads that are static or never repeat."""

    @property
    @abstractmethod
    def frequency_of_interest(self) -> tuple[float, str] | None:
        """Highest frequency of it that a response shall show, Hz, and why; None for static loads."""

    @property
    @abstractmethod
    def rise_time(self) -> float:
        """Duration of the smooth start, s; 0: it acts at once."""

    @abstractmethod
    def at_full_amplitude(self) -> Self:
        """Return the load without its smooth start."""

    def with_other_noise(self, number: int) -> Self:  # noqa: ARG002
        """Return the load with noise that is independent of this one, another for each number; itself without noise."""
        return self

    @abstractmethod
    def frequency_words(self, step: float) -> tuple[str, str] | None:
        """Return the frequency of the load and how well steps, s, resolve it, in words; None for static loads."""

    @property
    def extent(self) -> tuple[float, float] | None:
        """Start and end of a load along the beam, x in m; None for others."""
        return None

    @property
    def parts(self) -> tuple[LoadPart, ...]:
        """Parts of the load, at least one: for most loads, the load itself."""
        return (LoadPart(str(vars(self)["name"]), self.place, self.time_function),)

    @property
    def derivative(self) -> int:
        """Order of the derivative of the given quantity that s is."""
        return 0

    @property
    def repeats(self) -> bool:
        """True for a static load or one with a forcing frequency, under which periodic responses can be sought."""
        return self.static or self.forcing_frequency is not None

    @property
    def weight_acceleration(self) -> float:
        """Static acceleration of all mass, m/s^2, which gives the beam its weight."""
        return self.peak if self.static and isinstance(self.place, BodyForce) else 0.0

    @property
    def attachment(self) -> Attachment | None:
        """Mass, spring and damper that it adds to the beam where it acts, along its direction."""
        return None

    @property
    def may_rest(self) -> bool:
        """True where the load, or its constant force, may belong to the seat, whatever the values of its keys."""
        return self.static

    @property
    def static_force(self) -> StaticForce | None:
        """Constant force in addition to s, at the same place and along the same direction; it is part of the seat."""
        return None

    @property
    def travel(self) -> tuple[float, float]:
        """Least and largest change of a clearance, m; zeros for loads that change none."""
        return 0.0, 0.0

    @property
    def curve_units(self) -> Mapping[str, str]:
        """Units of the keys that a curve of periodic responses may vary: those that no body depends on."""
        return {}

    def without_cheap_keys(self) -> Self:
        """Return the load with all keys at neutral values that the model of a beam does not depend on.

        A model takes place and direction from a load: whatever leaves these as they are is cheap to change.
        """
        bare = self
        for key, field in type(self).model_fields.items():
            neutral = _example(type(self), key) if field.is_required() and field.examples else field.get_default()
            if key not in self.of_model and not (field.is_required() and not field.examples):
                changed = bare.model_copy(update={key: neutral})
                bare = changed if changed.place == self.place else bare
        return bare

    def generated(
        self,
        end: float,  # noqa: ARG002 - for those that override it
        loads: Sequence[LoadTable] = (),  # noqa: ARG002
    ) -> Mapping[str, Any] | None:
        """Return the generated and the requested spectrum of a random signal up to a time, s; None for other loads.

        Args:
            end: s.
            loads: All loads of the case.
        """
        return None

    def with_checksum(self) -> Self:
        """Return the load with the checksum of the file that it is read from; itself without a file.

        Raises:
            UserError: The file cannot be used, or is another one than its checksum says.
        """
        return self

    def faults(self, key: Key) -> Iterator[Fault]:  # noqa: ARG002 - for those that override it
        """Yield the faults of the load beyond single values.

        Args:
            key: The way to its table in the case, to which a fault adds the key that it is about.
        """
        yield from ()

    def faults_among(self, key: Key, loads: Mapping[int, LoadTable]) -> Iterator[Fault]:  # noqa: ARG002 - for those that override it
        """Yield the faults of the load together with the other loads of the case.

        Args:
            key: The way to its table in the case.
            loads: All loads by their number in the case file, from 0.
        """
        yield from ()

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:  # noqa: ARG002 - for those that override it
        """Yield the faults of the load in a run.

        Args:
            key: The way to its table in the case.
            end: End of the run, s.
            step: Time step, s; None: computed later.
        """
        yield from ()

    @property
    def acts(self) -> bool:
        """True for an amplitude other than 0, or none."""
        return bool(vars(self).get("amplitude", True))

    def unusual_values(self) -> Iterator[str]:
        """Yield unusual values, in words that continue after the name of the load, such as one that does nothing."""
        if not self.acts:
            yield "amplitude = 0: it does nothing"

    def unusual_shaking(self, wave_speed: float, length: float) -> Iterator[str]:
        """Yield an acceleration of supports with which impacts would strain the beam beyond `HARDEST`, v / c.

        Args:
            wave_speed: c of the material, m/s.
            length: Length over which v is reached, m.
        """
        place = self.place
        shakes = isinstance(place, SupportAcceleration) or (isinstance(place, SupportWalls) and not place.opens)
        if shakes and self.peak * length > (HARDEST * wave_speed) ** 2:
            recorded = "time_scale" in type(self).model_fields
            yield (
                f"shakes the support with {self.peak:.3g} m/s^2, {self.peak / STANDARD_GRAVITY:.3g} g: over the length "
                f"of the beam it would reach {100.0 * HARDEST:g} % of the wave speed of the material; are "
                f"{'scale and time_scale right' if recorded else 'its values in SI units'}?"
            )

    def unusual_in_run(self, end: float) -> Iterator[str]:  # noqa: ARG002 - for those that override it
        """Yield unusual values in a run with this end, s, in words as those of `unusual_values`."""
        yield from ()

    def unusual_waves(self, half_wave: float) -> Iterator[str]:  # noqa: ARG002 - for those that override it
        """Yield features of the load that bending waves of this half wave, m, are too short for."""
        yield from ()

    def unusual_steps(self, step: float) -> Iterator[str]:  # noqa: ARG002 - for those that override it
        """Yield features that a time step, s, is too long for, in words that continue after the step."""
        yield from ()

    def unusual_records(self, interval: float) -> Iterator[str]:  # noqa: ARG002 - for those that override it
        """Yield features that an interval between records, s, is too long for, in words that continue after it."""
        yield from ()


class RampedLoad(LoadTable):
    """A load with a smooth start over its key `ramp`, which stands where its table has it."""

    @property
    def rise_time(self) -> float:
        """Duration of the ramp, s."""
        return float(vars(self)["ramp"])

    def at_full_amplitude(self) -> Self:
        """Return the load without its ramp."""
        return self.model_copy(update={"ramp": 0.0})

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a smooth start that is longer than the run."""
        if exceeds(ramp := float(vars(self)["ramp"]), end):
            yield "ramp = {} is longer than the run, {} s".format(*apart(ramp, end))


Column = Annotated[int, Strict(), Field(ge=1, le=10_000)] | Annotated[str, Field(min_length=1, max_length=100)]


Holes = Literal["refuse", "linear", "spline", "zero"]


@cache
def _example(table: type[Table], key: str) -> Any:
    """Return the example of a key without a default, as its table takes it."""
    field = table.model_fields[key]
    return TypeAdapter[Any](field.annotation).validate_python((field.examples or [None])[0])


class RecordedTable(RampedLoad):
    """A load recorded over time: scale * (value - mean) + offset, with a curve between the rows."""

    name: Name = Field(default="recorded", description="unique name")
    file: str = Field(
        min_length=1,
        description="text file with a row for each time, relative to the case file",
        examples=["signals/shaker.csv"],
    )
    time_column: Column = Field(
        default=1, description="column of the times: number from 1, or name in the line above the rows"
    )
    value_column: Column = Field(default=2, description="column of the values: number, or name")
    time_scale: Positive = Field(default=1.0, description="factor of the times of the file, 1e-3 for ms, no unit")
    scale: Number = Field(default=1.0, description="factor of the values of the file, 9.81 for g, no unit")
    offset: Number = Field(
        default=0.0, description="offset added to the scaled values, N or, for motion, m/s^2, m/s or m"
    )
    remove_mean: Switch = Field(default=False, description="take the mean over the record off its values")
    start: Number | None = Field(
        default=None, description="time of the record at which the run starts, s; default that of its first row"
    )
    ramp: NonNegative = Field(default=0.0, description="duration of the smooth start, s")
    beyond: Literal["refuse", "zero", "repeat"] = Field(
        default="refuse",
        description="outside the record: refused, zero, or the record again, whose last row is the first"
        " of the next round",
    )
    interpolation: Literal["cubic", "monotone"] = Field(
        default="cubic",
        description="curve between the rows: a cubic spline, or piecewise cubics without overshoot, for pulses and "
        "jumps",
    )
    holes: Holes = Field(
        default="refuse",
        description="where rows are more than three median intervals apart: refused, a straight line, the curve of "
        "`interpolation`, or 0",
    )
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default upward, toward the gland"
    )
    checksum: str | None = Field(
        default=None,
        min_length=64,
        max_length=64,
        description="SHA-256 of the file; results write it into their case; default any",
    )

    @property
    def derivatives(self) -> int:
        """Number of times that the values of the file are differentiated in time."""
        return self.derivative


LARGEST = 100.0
"""Usual acceleration, m/s^2."""


class StaticLoad(LoadTable, ABC):
    """A load that acts before the run and stays constant."""

    forcing_frequency: ClassVar[None] = None  # it is static
    frequency_of_interest: ClassVar[None] = None  # it is static
    rise_time: ClassVar[float] = 0.0  # it acts before the run
    static: ClassVar[bool] = True

    def at_full_amplitude(self) -> Self:
        """Return the load itself."""
        return self

    def frequency_words(self, step: float) -> None:
        """Return None: it is static."""


class Gravity(StaticLoad):
    """Body force density * acceleration; part of the static seat."""

    place: ClassVar[BodyForce] = BodyForce()
    alone: ClassVar[bool] = True
    default_sense: ClassVar[float] = -1.0

    type: Literal["gravity"] = Field(description="kind of load")
    name: Name = Field(default="gravity", description="unique name")
    acceleration: NonNegative = Field(default=9.81, description="acceleration of gravity, m/s^2")
    direction: Vector | None = Field(
        default=None, description="vector of any length > 0, no unit; default downward, toward the base"
    )

    def time_function(self) -> TimeFunction:
        """Return s(t) = acceleration."""
        return constant(self.acceleration)

    @property
    def peak(self) -> float:
        """The acceleration, m/s^2."""
        return self.acceleration

    def unusual_values(self) -> Iterator[str]:
        """Yield an acceleration that looks like another unit."""
        if self.acceleration > LARGEST:
            yield f"acceleration = {self.acceleration:g} is unusual; the unit is m/s^2"
