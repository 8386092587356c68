"""Records of a periodic response: the first is the last, and forces balance the load by statics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam

LENGTH, PLACES, END, FORCE, MASS = 4.0, (0.1, 3.1), 4.0, 60.0, 7850.0 * 4.0 * 0.06 * 0.04


def girder(method: str, model: str) -> dict[str, Any]:
    """Return a bar on two bearings that a slow force lifts and presses at its overhanging end."""
    return {
        "beam": {"length": LENGTH, "thickness": 0.06, "width": 0.04},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "damping": {"frequencies": [10.0, 200.0], "ratios": [0.05, 0.05]},
        "support": [
            {
                "name": name,
                "from": x - 0.05,
                "to": x + 0.05,
                "clearance": 0.0,
                "region": "stop",
                "support_stiffness": 1e6,
                "support_damping": 2e3,
            }
            for name, x in zip(("west", "east"), PLACES, strict=True)
        ],
        "model": {"type": model},
        "mesh": {"dimension": 2},
        "load": [
            {"type": "gravity"},
            {"type": "harmonic_force", "name": "crowd", "point": END, "amplitude": FORCE, "frequency": 0.5},
        ],
        "probe": [{"name": "end", "point": END}],
        "figure": [{"name": "least", "quantity": "contact_force", "place": "west", "statistic": "minimum"}],
        "analysis": {"type": "periodic", "method": method},
        "time": {"end": 4.0},
    }


@pytest.mark.parametrize(("method", "model"), [("shooting", "beam"), ("harmonic-balance", "reduced")])
def test_the_first_force_is_the_last(method: str, model: str, tmp_path: Path) -> None:
    """A bearing that stays closed was recorded as open at t = 0, and its least force as 0."""
    done = gapbeam.run(girder(method, model), output=tmp_path / "out")
    assert done.summary is not None, done.message
    assert done.exit_status == 0
    force = gapbeam.open_results(tmp_path / "out").history["contact_force"].values
    swing = force.max(axis=0) - force.min(axis=0)
    assert np.abs(force[0] - force[-1]).max() < 0.02 * swing.max()
    west, east = PLACES
    weight, apart = MASS * 9.81, east - west
    still = weight * (east - 0.5 * LENGTH) / apart
    least = still - FORCE * (END - east) / apart
    assert float(done.summary["figures"]["least"]["value"]) == pytest.approx(least, rel=0.03)
