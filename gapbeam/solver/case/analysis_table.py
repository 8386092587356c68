"""The table [analysis]: what a run looks for."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.attachments.mean_motion import BENDING, MotionName
from gapbeam.solver.case.start_tables import StartMode, StartMotion
from gapbeam.solver.table import Number, Positive, Table, Whole


class Transient(Table):
    """A march from the seat, the undeformed pose or the middle of the play, to time.end."""

    type: Literal["transient"] = Field(default="transient", description="kind of analysis")
    start: Literal["seat", "undeformed", "centered"] = Field(
        default="seat",
        description="state at t = 0, at rest: the static seat; undeformed, flat on the base, from which the "
        "beam falls; or undeformed in the middle of the play",
    )

    state: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="results folder of an earlier run of the same model, relative to the case file, whose "
        "kept state is the start; default none",
        examples=["results/settled"],
    )
    state_time: Positive | None = Field(
        default=None,
        description="time of that run, one of its output.keep_states, s; default the last",
        examples=[0.1],
    )
    motion: StartMotion | None = Field(
        default=None, description="a rigid motion added to that state, a table; default none"
    )
    mode: StartMode | None = Field(
        default=None, description="a vibration mode added to that state, a table; default none"
    )

    @property
    def needs_seat(self) -> bool:
        """True where every computation starts from the static seat."""
        return self.start == "seat" and self.state is None

    @property
    def start_words(self) -> str:
        """Start of a run, in a sentence."""
        return self.start if self.state is None else "from the state of another run"

    @property
    def moves_aside(self) -> frozenset[MotionName]:
        """The motions of the start that are not those of a beam in its bending plane."""
        found = () if self.motion is None else (self.motion.pose(0.0), self.motion.rate(0.0))
        return frozenset(name for one in found for name in one.names).difference(BENDING)

    @property
    def for_body(self) -> Transient:
        """Return the part of the start that a body depends on: motions that leave bending in the plane."""
        if not self.moves_aside:
            return Transient()
        along, across, turned, twisted = (
            float(name in self.moves_aside) for name in ("axial", "lateral", "lateral_rotation", "twist")
        )
        return Transient(motion=StartMotion(velocity=(along, across, 0.0), spin=(twisted, 0.0, turned)))


class Continuation(Table):
    """A curve of periodic responses, followed from the value of the case in both directions."""

    key: str = Field(
        min_length=1,
        max_length=100,
        description="parameter: support.clearance, contact.stiffness, contact.damping, load.NAME.amplitude, "
        "load.NAME.frequency (shared by all loads), or of an exciter load.NAME.mass, .stiffness, .damping, "
        ".preload",
        examples=["load.shaker.frequency"],
    )
    low: Number = Field(description="least value, in the unit of the key", examples=[15.0])
    high: Number = Field(description="largest value, in the unit of the key", examples=[25.0])
    first_step: Positive = Field(
        default=0.01, lt=1, description="first arc length, relative to the range and the size of the response, no unit"
    )
    longest_step: Positive = Field(default=0.1, lt=1, description="longest arc length, likewise, no unit")
    max_points: Whole = Field(default=300, ge=1, le=100000, description="largest number of points in each direction")


class Periodic(Table):
    """A periodic response by shooting or harmonic balance, with its stability, or a curve of them."""

    type: Literal["periodic"] = Field(description="kind of analysis")
    method: Literal["shooting", "harmonic-balance"] = Field(
        default="shooting", description="Newton's method on the period map, or on the harmonics"
    )
    periods: Whole = Field(
        default=1, ge=1, le=100, description="forcing periods in a period of the response; 3 finds a period-3 response"
    )
    start: Literal["march", "seat"] = Field(
        default="march", description="start of the search: the end of a march to time.end, or the seat"
    )
    tolerance: Positive = Field(
        default=1.0e-8, lt=1, description="largest change of the state over a period, relative, no unit"
    )
    max_iterations: Whole = Field(default=30, ge=1, le=1000, description="largest number of Newton iterations")
    harmonics: Whole = Field(
        default=40, ge=1, le=1000, description="harmonic-balance: number of harmonics of the period of the response"
    )
    samples_per_harmonic: Whole = Field(
        default=64, ge=5, le=1000, description="harmonic-balance: samples in a period over the number of harmonics"
    )
    continuation: Continuation | None = Field(
        default=None, description="parameter to vary, a table; default none: one response"
    )

    @property
    def start_words(self) -> str:
        """Start of the march before a search, in a sentence."""
        return "seated"

    @property
    def needs_seat(self) -> bool:
        """True: marches before the search start at the static seat."""
        return True

    @property
    def moves_aside(self) -> frozenset[MotionName]:
        """None: the search starts at rest."""
        return frozenset()

    @property
    def for_body(self) -> Transient:
        """A body does not depend on the search."""
        return Transient()


Analysis = Annotated[Transient | Periodic, Field(discriminator="type")]
