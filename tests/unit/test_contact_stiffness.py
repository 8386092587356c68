"""The computed contact stiffness: continuous in every clearance, down to none."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.case.computed_defaults import contact_stiffness

CELL = 2.5e-3  # m


def stiffness(clearances: list[float], amplitude: float = 20.0, scheme: str = "discrete-gradient") -> float:
    """Return K of a beam between supports with these clearances."""
    supports: list[dict[str, Any]] = [
        {"name": f"s{number}", "from": 0.1 * number, "to": 0.1 * number + 0.02, "clearance": clearance}
        for number, clearance in enumerate(clearances)
    ]
    tables = {
        "beam": {"length": 0.5, "thickness": 0.01, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": supports,
        "model": {"type": "beam"},
        "load": [{"type": "harmonic_force", "point": 0.45, "amplitude": amplitude, "frequency": 20.0}],
        "time": {"end": 0.01, "step": 1.0e-5, "scheme": scheme},
    }
    return contact_stiffness(gapbeam.read_case(tables), CELL, 4.0e-4).value


@pytest.mark.parametrize("scheme", ["discrete-gradient", "newmark"])
@pytest.mark.parametrize("others", [[], [2.0e-4]])
def test_no_jump_at_no_clearance(others: list[float], scheme: str) -> None:
    """A clearance of 1e-15 m, of either size of force, gives the stiffness of none, alone and beside other supports."""
    for amplitude in (0.2, 20.0, 2000.0):
        none = stiffness([0.0, *others], amplitude, scheme)
        assert stiffness([1.0e-15, *others], amplitude, scheme) == pytest.approx(none, rel=1e-2)


@given(st.floats(-13.0, -3.0), st.floats(0.0, 3.0))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_the_stiffness_is_continuous(exponent: float, size: float) -> None:
    """One part in 1e6 of a clearance changes at most as much of the stiffness, times what 1 % of it asks for."""
    clearance, amplitude = 10.0**exponent, 10.0**size
    one, other = stiffness([clearance], amplitude), stiffness([clearance * (1.0 + 1.0e-6)], amplitude)
    assert other == pytest.approx(one, rel=2.0e-6)
