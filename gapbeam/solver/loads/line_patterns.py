"""The patterns of a random load along the beam: forces at Gauss points with the covariance of the load.

The force per length q(x, t) = v(x)^2 s(x, t) has the cross-spectral density S(f) v(x)^2 v(x')^2 rho(|x - x'|). The
motion of the beam along the load is a polynomial through its values at n Gauss points, u(x) = sum_i l_i(x) u_i. So the
load does the work of forces Q_i at these points with the covariance S(f) C,

    C_ij = int int l_i(x) v(x)^2 l_j(x') v(x')^2 rho(|x - x'|) dx dx',

which is exact for polynomials of degree n - 1. C = sum_k w_k w_k^T makes it a sum of patterns with independent noises.

Source: Axisa, Antunes and Villard, Journal of Fluids and Structures 4 (1990), 321-341, for the joint acceptance.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gapbeam.solver.loads.coherence.coherence_table import CoherenceTable
from gapbeam.solver.loads.coherence.double_integrals import double_integrals
from gapbeam.solver.loads.places import LineForce
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
