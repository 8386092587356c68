"""The coherence of a load along the beam as it was generated, beside the one asked for, with the scatter of chance.

The load acts as forces Q_i at stations (`line_patterns`). All of them have the spectrum S(f) of the load, and the
coherence does not depend on frequency; so that the correlation of two of them is their coherence,

    rho_ij = C_ij / (C_ii C_jj)^(1/2),

with the integrals C of the coherence asked for. That of the signals is r = sum Q_i Q_j / (sum Q_i^2 sum Q_j^2)^(1/2)
over the times of the run. Fisher's atanh(r) is normal about atanh(rho) with the variance 1 / (n - 3), for

    n = 2 T (int S df)^2 / int S^2 df

independent pairs in the time T. The integrals spread the coherence of two places over the reach of the stations:
beside rho_ij stands the curve at their distance.

Source: Fisher, Metron 1 (1921) 3, for atanh(r); Bendat and Piersol, Random Data (2010), section 8.2, for n.

The patterns of a random load along the beam: forces at Gauss points with the covariance of the load.

The force per length q(x, t) = v(x)^2 s(x, t) has the cross-spectral density S(f) v(x)^2 v(x')^2 rho(|x - x'|). The
motion of the beam along the load is a polynomial through its values at n Gauss points, u(x) = sum_i l_i(x) u_i. So the
load does the work of forces Q_i at these points with the covariance S(f) C,

    C_ij = int int l_i(x) v(x)^2 l_j(x') v(x')^2 rho(|x - x'|) dx dx',

which is exact for polynomials of degree n - 1. C = sum_k w_k w_k^T makes it a sum of patterns with independent noises.

Source: Axisa, Antunes and Villard, Journal of Fluids and Structures 4 (1990), 321-341, for the joint acceptance.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import atanh, sqrt, tanh
from typing import Any

import numpy as np
from scipy.stats import norm

from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable, double_integrals
from gapbeam.solver.loads.generated_spectrum import CONFIDENCE
from gapbeam.solver.loads.places import LineForce
from gapbeam.solver.loads.random_function import RandomSignal
from gapbeam.solver.loads.spectra.power_spectrum import PowerSpectrum
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
        coherence: Over distance.
        span: Where the load begins and ends, x on the beam axis, m.
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
        coherence: As in `line_patterns`, like the rest.
        span: Likewise.
        stations: Likewise.
        profile: Likewise.
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
        signals: Of the patterns, without their smooth starts.
        weights: Of the patterns at the stations, (patterns, stations).
        coherence: Asked for.
        span: Of the load, x on the beam axis, m.
        profile: Of its velocity.
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
    reach = float(norm.ppf(0.5 + 0.5 * CONFIDENCE)) / sqrt(pairs - 3.0)
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
