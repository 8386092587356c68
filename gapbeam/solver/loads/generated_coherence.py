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
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atanh, sqrt, tanh
from typing import Any

import numpy as np
from scipy.stats import norm

from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable
from gapbeam.solver.loads.generated_spectrum import CONFIDENCE
from gapbeam.solver.loads.line_patterns import Profile, station_covariance
from gapbeam.solver.loads.random_function import RandomSignal
from gapbeam.solver.loads.spectra.power_spectrum import PowerSpectrum
from gapbeam.solver.system.operators import Array

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
