"""A random force per length along the beam, such as that of turbulent cross flow, with a coherence and a profile."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from math import ceil
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.coherence.coherence_table import CoherenceChoice
from gapbeam.solver.loads.generated_coherence import Profile, compared_coherence, line_patterns
from gapbeam.solver.loads.load_parts import LoadPart
from gapbeam.solver.loads.load_table import OF_MODEL, LoadTable
from gapbeam.solver.loads.places import LineForce
from gapbeam.solver.loads.random_function import RandomSignal
from gapbeam.solver.loads.random_load import PEAK, PairedNoiseLoad
from gapbeam.solver.loads.spectra.spectrum_table import SpectrumChoice
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.table import NonNegative, Number, Table, Whole
from gapbeam.solver.wording.short_words import apart, exceeds

MOST_ROWS = 200
LEAST_RATIO = 0.02  # of a coherence length to the length of the load: shorter ones need no patterns, and many points
PER_HALF_WAVE, MORE = 2.0, 4  # stations that bending waves need
OF_PATTERNS = ("span", "coherence", "velocity_profile", "stations")  # keys
Stations = Annotated[Whole, Field(ge=2, le=48)]


class VelocityProfile(Table):
    """Relative velocity of a flow along the beam; the force is proportional to its square."""

    places: tuple[NonNegative, ...] = Field(
        min_length=2, max_length=MOST_ROWS, description="ascending x along the beam, m", examples=[[0.0, 0.3, 1.0]]
    )
    values: tuple[NonNegative, ...] = Field(
        min_length=2,
        max_length=MOST_ROWS,
        description="velocity at each place over that of the spectrum, straight lines in between, no unit",
        examples=[[0.5, 1.0, 1.0]],
    )


class RandomLineLoad(PairedNoiseLoad):
    """A random force per length along the beam, whose coherence falls with the distance of two places."""

    of_model: ClassVar[tuple[str, ...]] = (*OF_MODEL, *OF_PATTERNS)

    type: Literal["random-line-load"] = Field(description="kind of load")
    span: tuple[Number, Number] = Field(description="x where the load begins and ends, m", examples=[[0.1, 0.9]])
    spectrum: SpectrumChoice = Field(
        description="spectral density of the force per length over frequency, (N/m)^2/Hz",
        examples=[{"type": "white", "density": 0.01, "high": 500.0}],
    )
    coherence: CoherenceChoice = Field(
        description="how alike the force is at two places", examples=[{"type": "exponential", "length": 0.05}]
    )
    velocity_profile: VelocityProfile | None = Field(
        default=None, description="relative velocity along the beam; default 1 at all places"
    )
    stations: Stations = Field(
        default=16,
        description="number of places where forces stand for the load; bending of up to half as many half waves is "
        "loaded as by the load itself",
    )

    @property
    def patterns(self) -> tuple[LineForce, ...]:
        """Forces that act together, the strongest first; each has a noise of its own."""
        if any(self._shape_faults(())):  # of a load that will be refused, other checks ask the place
            return (LineForce(self.span, (0.0, 0.0)),)
        return line_patterns(self.coherence, self.span, self.stations, self._profile)

    @property
    def place(self) -> LineForce:
        """Those of the strongest pattern."""
        return self.patterns[0]

    @property
    def extent(self) -> tuple[float, float]:
        """The span."""
        return self.span

    @property
    def unit(self) -> str:
        """Unit of the noise."""
        return "N/m"

    @property
    def peak(self) -> float:
        """Three times the rms of the force of the whole load, N."""
        whole = sum(sum(pattern.weights) ** 2 for pattern in self.patterns)
        return PEAK * self.signal.spectrum.rms * float(np.sqrt(whole))

    @property
    def parts(self) -> tuple[LoadPart, ...]:
        """A part for each pattern."""
        return tuple(
            LoadPart(f"{self.name} {number}", pattern, partial(self._noise, number))
            for number, pattern in enumerate(self.patterns, 1)
        )

    @property
    def signal(self) -> RandomSignal:
        """The noise of the strongest pattern."""
        return self._signal(1)

    def _signal(self, number: int) -> RandomSignal:
        own = RandomSignal(self.spectrum.spectrum(), self.seed, f"{self.name} {number}", self.ramp)
        return self._with_shared(own, f" {number}")

    def generated(self, end: float, loads: Sequence[LoadTable] = ()) -> Mapping[str, Any]:
        """Return spectrum and coherence of the load up to a time, s, beside those asked for."""
        full = self.at_full_amplitude()
        signals = [full._signal(number) for number in range(1, len(self.patterns) + 1)]
        weights = np.array([pattern.weights for pattern in self.patterns])
        found = compared_coherence(signals, weights, self.coherence, self.span, self._profile, end)
        return {**super().generated(end, loads), "coherence": found}

    def _noise(self, number: int) -> TimeFunction:
        signal = self._signal(number)
        return TimeFunction(signal.value, signal.mean, signal=signal)

    @property
    def _profile(self) -> Profile | None:
        profile = self.velocity_profile
        return None if profile is None else (profile.places, profile.values)

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield a span without length, coherences and profiles that are none, and too short coherence lengths."""
        yield from super().faults(key)
        yield from self._shape_faults(key)

    def _noise_faults(self, key: Key, other: PairedNoiseLoad, number: int) -> Iterator[Fault]:
        """Yield noise that cannot be shared, and another span, coherence, profile or number of stations."""
        yield from super()._noise_faults(key, other, number)
        for name in OF_PATTERNS:
            own, theirs = getattr(self, name), getattr(other, name)
            if own != theirs:
                plain = isinstance(own, int | tuple)
                yield Fault(
                    (*key, name),
                    f"{own}, with {theirs} of {other.name}" if plain else f"another one than that of {other.name}",
                    "the same in both: each pattern of forces shares its noise with one of the other load",
                    f"{name} = {list(theirs) if isinstance(theirs, tuple) else theirs}" if plain else "copy it",
                    (("load", number, name),),
                )

    def _shape_faults(self, key: Key) -> Iterator[Fault]:
        """Yield what is wrong with span, coherence and profile."""
        begin, end = self.span
        if begin >= end:
            try_this = f"span = [{end:g}, {begin:g}]" if begin > end else "two different places, in m"
            yield Fault((*key, "span"), f"from {begin:g} to {end:g} m", "an end behind the begin", try_this)
            return
        wrong = [*self.coherence.faults((*key, "coherence")), *self._profile_faults((*key, "velocity_profile"))]
        yield from wrong
        shortest = LEAST_RATIO * (end - begin)
        given = getattr(self.coherence, "length", None)
        if given is not None and exceeds(shortest, given):
            found, least = apart(given, shortest)
            yield Fault(
                (*key, "coherence", "length"),
                f"{found} m, on a load of {end - begin:g} m",
                f"at least {least} m: what is shorter loads all bending waves alike",
                f"length = {shortest:.3g}, with densities times {given / shortest:.3g}: their product counts",
                ((*key, "span"),),
            )

    def _profile_faults(self, key: Key) -> Iterator[Fault]:
        profile = self.velocity_profile
        if profile is None:
            return
        places, values = profile.places, profile.values
        if len(places) != len(values):
            yield Fault(
                (*key, "values"), f"{len(values)} for {len(places)} places", "one for each", related=((*key, "places"),)
            )
        elif any(one >= following for one, following in pairwise(places)):
            yield Fault((*key, "places"), f"{list(places)}", "places that ascend", "sort the rows")
        elif places[0] > self.span[0] or places[-1] < self.span[1]:
            yield Fault(
                (*key, "places"),
                f"from {places[0]:g} to {places[-1]:g} m, for a load from {self.span[0]:g} to {self.span[1]:g} m",
                "the whole span of the load",
                "rows at both ends of the span; a velocity of 0 where nothing flows",
                ((*key[:-1], "span"),),
            )
        elif not any(np.interp(np.linspace(*self.span, 101), places, values) > 0.0):
            yield Fault((*key, "values"), "0 along the whole load", "a velocity somewhere", "leave the load out")

    def unusual_waves(self, half_wave: float) -> Iterator[str]:
        """Yield bending waves that are too short for the places of the forces."""
        half_waves = (self.span[1] - self.span[0]) / half_wave
        needed = ceil(PER_HALF_WAVE * half_waves) + MORE
        if needed > self.stations:
            yield (
                f"has {self.stations} stations for {half_waves:.3g} half waves of bending at its frequencies; "
                f"stations = {min(needed, 48)} would load them as asked for"
            )
