"""What a damped line of contact returns, clipped as a whole: by 400 points of the strip, each with a spring and damper.

Source: direct integration of a mass on the points, p = K <d - s^2 / 2r> + c d' clipped point by point, against the
resultant of all of them clipped together.
"""

from __future__ import annotations

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.contact.laws.line_law import slower_return

POINTS = (np.arange(400) + 0.5) / 400.0
STEP = 2.0e-3  # of the time in which a mass of 1 with a speed of 1 crosses a depth of 1


def returned(ratio: float, whole: bool) -> float:
    """Return the speed at which a mass leaves a strip p = d - s^2 + c d' of unit stiffness, by midpoint steps."""

    def force(depth: float, speed: float) -> float:
        if depth <= 0.0:
            return 0.0
        below = depth * (1.0 - POINTS**2)  # s from 0 to sqrt(depth), both sides
        pressure = below + ratio * speed
        width = 2.0 * np.sqrt(depth) / len(POINTS)
        return float(max(pressure.sum(), 0.0) * width if whole else np.maximum(pressure, 0.0).sum() * width)

    depth, speed = 0.0, 1.0
    while depth >= 0.0:
        middle = depth + 0.5 * STEP * speed, speed - 0.5 * STEP * force(depth, speed)
        depth, speed = depth + STEP * middle[1], speed - STEP * force(*middle)
    return -speed


@pytest.mark.parametrize("ratio", [0.05, 0.3, 1.0])
def test_a_strip_returns_less_than_its_points(ratio: float) -> None:
    """From 0.94 down to 0.35 of the speed."""
    points, strip = returned(ratio, whole=False), returned(ratio, whole=True)
    assert slower_return(points) == pytest.approx(1.0 - strip / points, rel=0.02, abs=2e-5)
    assert strip < points


@pytest.mark.parametrize(("restitution", "share"), [(0.9, "0.18 %"), (0.6, "2.8 %")])
def test_check_says_so_where_lines_are_met(restitution: float, share: str) -> None:
    """Of a tube at stations between flat walls; not where the damper may pull."""
    tables = {
        "beam": {"length": 1.0, "thickness": 0.02, "width": 0.02, "section": {"type": "tube", "wall": 0.002}},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 8000.0},
        "support": [
            {"name": name, "from": x, "to": x + 0.02, "clearance": 2e-4,
             "region": {"type": "polygon", "walls": [0.0, 90.0, 180.0, -90.0]}}
            for name, x in (("a", 0.1), ("b", 0.8))
        ],
        "contact": {"stiffness": 1e11, "law": {"type": "kelvin-voigt", "restitution": restitution}},
        "mesh": {"dimension": 3},
        "model": {"type": "beam", "stations": 4, "elements": 20},
        "load": [{"type": "gravity"}],
        "time": {"end": 1e-3, "step": 1e-5},
    }  # fmt: skip
    words = f"a section comes back about {share} slower than from points"

    def reasons(*settings: str) -> list[str]:
        model = gapbeam.model(gapbeam.read_case(tables, settings)).model
        return [default.reason for default in model.defaults if default.key == "contact.damping"]

    assert [words in reason for reason in reasons()] == [True]
    assert not any("comes back" in reason for reason in reasons('contact.tension="adhesive"'))
