"""Schemes that are known to create energy at impacts on stiff contact."""

from __future__ import annotations

from solver.case_tables.time import GeneralizedAlpha, HHTAlpha, Newmark, Scheme

SAFE_GAMMA = 0.65  # of Newmark's rule
SAFE_RADIUS = 0.5  # of generalized-alpha, at infinite frequency
SAFE_ALPHA = 0.2  # of HHT-alpha


def creates_energy(scheme: Scheme) -> bool:
    """Return whether a scheme is known to create energy on stiff contact.

    Newmark's rule with gamma < 0.65, HHT-alpha with alpha < 0.2 and generalized-alpha with rho_inf > 1/2: they were
    caught at it, up to gamma = 0.6, alpha = 0.15 and down to rho_inf = 0.6. At the limits it is left to the gates.

    Source: docs/stability.md.
    """
    match scheme:
        case Newmark(gamma=gamma):
            return gamma < SAFE_GAMMA
        case HHTAlpha(alpha=alpha):
            return alpha < SAFE_ALPHA
        case GeneralizedAlpha(rho_inf=radius):
            return radius > SAFE_RADIUS
    return False
