"""Snapshots: what field files show of a motion at some times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State


class Snapshots(NamedTuple):
    """Some instants, row by row.

    Attributes:
        times: (times,), s.
        u: DOFs that are marched and that this rank owns, (times, n).
        v: Their velocities, (times, n).
        pressure: Contact pressure at all points, (times, m), Pa.
    """

    times: Array
    u: Array
    v: Array
    pressure: Array

    @classmethod
    def of_states(cls, states: Sequence[State]) -> Snapshots:
        """Return those of one or more states."""
        return cls(
            np.array([state.time for state in states]),
            np.stack([state.u[VALUE] for state in states]),
            np.stack([state.v[VALUE] for state in states]),
            np.stack([state.pressure for state in states]),
        )
