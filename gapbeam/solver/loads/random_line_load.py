"""Random force per length along the beam, such as turbulent cross flow causes, with a coherence and a profile.

The coherence as generated is compared with the one asked for. The load acts as forces Q_i at stations
(`line_patterns`). All of them have the spectrum S(f) of the load, and the coherence does not depend on frequency; so
that the correlation of two of them is their coherence,

    rho_ij = C_ij / (C_ii C_jj)^(1/2),

with the integrals C of the coherence asked for. Signals have r = sum Q_i Q_j / (sum Q_i^2 sum Q_j^2)^(1/2)
over the times of the run. Fisher's atanh(r) is normal about atanh(rho) with the variance 1 / (n - 3), for

    n = 2 T (int S df)^2 / int S^2 df

independent pairs in the time T. The integrals spread the coherence of two places over the reach of the stations:
beside rho_ij stands the curve at their distance.

Source: Fisher, Metron 1 (1921) 3, for atanh(r); Bendat and Piersol, Random Data (2010), section 8.2, for n.

The stations are Gauss points, with the covariance of the load. The force per length q(x, t) = v(x)^2 s(x, t) has the
cross-spectral density S(f) v(x)^2 v(x')^2 rho(|x - x'|). The motion of the beam along the load is a polynomial through
its values at n Gauss points, u(x) = sum_i l_i(x) u_i. So the load does the work of forces Q_i at these points with the
covariance S(f) C,

    C_ij = int int l_i(x) v(x)^2 l_j(x') v(x')^2 rho(|x - x'|) dx dx',

which is exact for polynomials of degree n - 1. C = sum_k w_k w_k^T makes it a sum of patterns with independent noises.

Source: Axisa, Antunes and Villard, Journal of Fluids and Structures 4 (1990), 321-341, for the joint acceptance.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache, partial
from itertools import pairwise
from math import atanh, ceil, sqrt, tanh
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import scipy
from pydantic import Field

from gapbeam.solver.loads.coherence_table import CoherenceChoice, CoherenceTable, double_integrals
from gapbeam.solver.loads.load_table import OF_MODEL, LoadTable
from gapbeam.solver.loads.places import LineForce, LoadPart
from gapbeam.solver.loads.random_function import CONFIDENCE, RandomSignal
from gapbeam.solver.loads.random_load import PEAK, PairedNoiseLoad
from gapbeam.solver.loads.random_spectra import PowerSpectrum, SpectrumChoice
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, exceeds
from gapbeam.solver.schema.table import NonNegative, Number, Table, Whole
from gapbeam.solver.system.operators import Array

LEFT_OUT = 1.0e-8  # of the sum of all mean squares: patterns that are weaker together
Profile = tuple[tuple[float, ...], tuple[float, ...]]
"""Places along the beam, m, and relative velocities there; straight lines in between, constant beyond."""


@lru_cache(maxsize=16)
def line_patterns(
    coherence: CoherenceTable, span: tuple[float, float], stations: int, profile: Profile | None
) -> tuple[LineForce, ...]:
    """Return the patterns of a load, the strongest first.

    Args:
        coherence: Coherence over distance.
        span: Start and end of the load, x on the beam axis, m.
        stations: n.
        profile: v(x); None: 1.
    """
    places, covariance = station_covariance(coherence, span, stations, profile)
    squares, vectors = np.linalg.eigh(covariance)
    squares, vectors = squares[::-1], vectors[:, ::-1]
    rest = np.cumsum(squares[::-1])[::-1]  # of each pattern and all weaker ones
    kept = max(1, int(np.sum(rest > LEFT_OUT * rest[0])))
    signs = np.sign(vectors[np.argmax(np.abs(vectors), axis=0), np.arange(stations)])
    patterns = (signs * np.sqrt(np.maximum(squares, 0.0)) * vectors).T[:kept]
    return tuple(LineForce(places, tuple(map(float, pattern))) for pattern in patterns)


def station_covariance(
    coherence: CoherenceTable, span: tuple[float, float], stations: int, profile: Profile | None
) -> tuple[tuple[float, ...], Array]:
    """Return the places of the stations, x on the beam axis, m, and C, (stations, stations), m^2.

    Args:
        coherence: Coherence over distance.
        span: Span of the load, x on the beam axis, m.
        stations: Number of stations.
        profile: Profile of the flow velocity.
    """
    (start, end), (nodes, weights) = span, np.polynomial.legendre.leggauss(stations)
    length = end - start
    degrees = np.arange(stations)
    at_nodes = np.polynomial.legendre.legvander(nodes, stations - 1) * weights[:, None] * (degrees + 0.5)

    def shapes(x: Array) -> Array:
        factor = 1.0 if profile is None else np.interp(start + x, *profile)[:, None] ** 2
        polynomials = np.polynomial.legendre.legvander(2.0 * x / length - 1.0, stations - 1) @ at_nodes.T
        return np.asarray(factor * polynomials)

    knots = None if profile is None else np.array(profile[0]) - start
    places = tuple(float(x) for x in start + 0.5 * length * (nodes + 1.0))
    return places, double_integrals(shapes, coherence, length, float(stations), knots)


RATE = 2.5  # samples in a period of the highest frequency: enough for products of signals
MOST_SAMPLES = 2**17
FEWEST_PAIRS = 30.0  # independent ones, for an interval
WEAK = 1.0e-3  # of the strongest force, below which a station says nothing
CERTAIN = 1.0 - 1.0e-9  # of a correlation: chance leaves nothing beyond
LINES = 4096  # for the integral of S^2


def compared_coherence(
    signals: Sequence[RandomSignal],
    weights: Array,
    coherence: CoherenceTable,
    span: tuple[float, float],
    profile: Profile | None,
    end: float,
) -> dict[str, Any]:
    """Return the coherence with the strongest station near the middle, as generated up to a time and as asked for.

    Args:
        signals: Signals of the patterns, without their smooth starts.
        weights: Weights of the patterns at the stations, (patterns, stations).
        coherence: Coherence that was asked for.
        span: Span of the load, x on the beam axis, m.
        profile: Profile of the flow velocity.
        end: s.

    Returns:
        `from` (place of the station, m), `independent` (n), `confidence` and `places`, each with `x`, `distance`, m,
        `curve`, `asked`, `generated` and the 95 % interval `low` to `high` of what was to be generated; none where the
        run is too short.
    """
    rate = RATE * signals[0].spectrum.high
    count = min(int(end * rate), MOST_SAMPLES)
    pairs = 2.0 * (count / rate) * bandwidth(signals[0].spectrum)
    stations, covariance = station_covariance(coherence, span, weights.shape[1], profile)
    sizes = np.sqrt(np.diag(covariance))
    strong = np.flatnonzero(sizes > WEAK * sizes.max())
    middle = int(min(strong, key=lambda place: abs(stations[place] - 0.5 * sum(span))))
    found: dict[str, Any] = {"from": stations[middle], "independent": pairs, "confidence": CONFIDENCE, "places": []}
    if pairs < FEWEST_PAIRS:
        return found
    times = np.arange(count) / rate
    forces = weights.T @ np.stack([signal.value(times) for signal in signals])
    products, squares = forces @ forces[middle], np.sum(forces**2, axis=1)
    reach = float(scipy.stats.norm.ppf(0.5 + 0.5 * CONFIDENCE)) / sqrt(pairs - 3.0)
    for place in (int(one) for one in strong if one != middle):
        asked = float(covariance[place, middle] / (sizes[place] * sizes[middle]))
        center = atanh(min(max(asked, -CERTAIN), CERTAIN))
        distance = abs(stations[place] - stations[middle])
        found["places"].append(
            {
                "x": stations[place],
                "distance": distance,
                "curve": float(coherence.at(np.array(distance))),
                "asked": asked,
                "generated": min(max(float(products[place] / sqrt(squares[place] * squares[middle])), -1.0), 1.0),
                "low": -1.0 if asked <= -CERTAIN else tanh(center - reach),
                "high": 1.0 if asked >= CERTAIN else tanh(center + reach),
            }
        )
    return found


def bandwidth(spectrum: PowerSpectrum) -> float:
    """Return (int S df)^2 / int S^2 df, Hz: the width of a flat spectrum whose power scatters as much."""
    edges: Array = np.asarray(np.linspace(spectrum.low, spectrum.high, LINES + 1), dtype=float)
    powers = np.diff(spectrum.power_below(edges))
    return float(powers.sum() ** 2 / np.sum(powers**2 / np.diff(edges)))


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
        description="velocity at each place relative to the spectrum's, straight lines in between, no unit",
        examples=[[0.5, 1.0, 1.0]],
    )


class RandomLineLoad(PairedNoiseLoad):
    """A random force per length, whose coherence falls with distance along the beam."""

    unit: ClassVar[str] = "N/m"
    of_model: ClassVar[tuple[str, ...]] = (*OF_MODEL, *OF_PATTERNS)

    type: Literal["random-line-load"] = Field(description="kind of load")
    span: tuple[Number, Number] = Field(description="x where the load begins and ends, m", examples=[[0.1, 0.9]])
    spectrum: SpectrumChoice = Field(
        description="spectral density of the force per length over frequency, (N/m)^2/Hz",
        examples=[{"type": "white", "density": 0.01, "high": 500.0}],
    )
    coherence: CoherenceChoice = Field(
        description="coherence of the force between two places", examples=[{"type": "exponential", "length": 0.05}]
    )
    velocity_profile: VelocityProfile | None = Field(
        default=None, description="relative velocity along the beam; default 1 at all places"
    )
    stations: Stations = Field(
        default=16,
        description="stations whose forces represent the load; accurate up to half as many half waves",
    )

    @property
    def patterns(self) -> tuple[LineForce, ...]:
        """Forces that act together, the strongest first; each has a noise of its own."""
        if any(self._shape_faults(())):  # of a load that will be refused, other checks ask the place
            return (LineForce(self.span, (0.0, 0.0)),)
        return line_patterns(self.coherence, self.span, self.stations, self._profile)

    @property
    def place(self) -> LineForce:
        """Place of the strongest pattern."""
        return self.patterns[0]

    @property
    def extent(self) -> tuple[float, float]:
        """The span."""
        return self.span

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
        """Return generated and requested spectrum and coherence of the load up to a time, s."""
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
                    f"{own}, with {theirs} of {other.name}" if plain else f"another one than {other.name} has",
                    "the same in both: each pattern of forces shares its noise with one of the other load",
                    f"{name} = {list(theirs) if isinstance(theirs, tuple) else theirs}" if plain else "copy it",
                    (("load", number, name),),
                )

    def _shape_faults(self, key: Key) -> Iterator[Fault]:
        """Yield the faults of span, coherence and profile."""
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
