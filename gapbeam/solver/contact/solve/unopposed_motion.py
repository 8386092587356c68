"""Unopposed motions: motions that close no contact, and along which loads do work.

With the work F of the loads along each motion, the openings G of contact points and the motions Z that holes bar,

    maximize F . c    subject to    G c >= 0,    Z c = 0,    -1 <= B c <= 1.

Contact can only push: where the optimum is 0, contact forces >= 0 balance the loads (Farkas), and there is a seat.

Source: Farkas (1902); Signorini (1959) and Fichera (1964) for the condition on the loads.
"""

from __future__ import annotations

import numpy as np
import scipy

from gapbeam.solver.system.operators import Array

WORKS = 1.0e-6  # of the largest force along a motion: less work is round-off
STRICT = 1.0e4  # factor on constraints: the tolerance of the solver, 1e-7, becomes 1e-11 of a motion


def unopposed_motion(work: Array, openings: Array, bounded: Array, barred: Array | None = None) -> Array | None:
    """Return the motion c, (k,), along which the loads do most work; None where that is round-off.

    Args:
        work: F, (k,), over the largest force along a motion.
        openings: G, (m, k).
        bounded: B, (b, k), whose rows have no larger values than 1.
        barred: Z, (h, k).
    """
    found = scipy.optimize.linprog(
        -work,
        A_ub=np.concatenate([-STRICT * openings, bounded, -bounded]),
        b_ub=np.concatenate([np.zeros(len(openings)), np.ones(2 * len(bounded))]),
        A_eq=None if barred is None else STRICT * barred,
        b_eq=None if barred is None else np.zeros(len(barred)),
        bounds=(None, None),
        method="highs",
    )
    return None if found.x is None or -found.fun <= WORKS else np.asarray(found.x)
