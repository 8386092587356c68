"""Vibro-impact by impulses: responses repeat as far as displacements do, and no figure is of a force by the step.

References: the motion between impacts by SciPy, impacts as events, momentum and restitution at each.
"""

from __future__ import annotations

from math import cos, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import gapbeam as gb
from gapbeam.postprocess.signals.steady_figures import figures_of_record, steady

K, C, CYCLES = 1e4, 2.0, 320


def repeats(mass: float, play: float, restitution: float, force: float, frequency: float) -> float:
    """Return how far strobes of the ball in the main body of 1 kg change in the last period, over its range."""
    t, y, end, strobes = 0.0, np.zeros(4), CYCLES / frequency, []

    def motion(t: float, y: Any) -> list[float]:
        return [y[1], force * cos(2.0 * pi * frequency * t) - K * y[0] - C * y[1], y[3], 0.0]

    def low(_: float, y: Any) -> float:
        return 0.5 * play + y[2] - y[0]

    def high(_: float, y: Any) -> float:
        return 0.5 * play - y[2] + y[0]

    for event in (low, high):
        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    asked = (CYCLES - np.arange(4)[::-1]) / frequency
    while t < end:
        found = solve_ivp(
            motion, (t, end), y, rtol=1e-9, atol=1e-13, events=[low, high], max_step=0.05 / frequency, dense_output=True
        )
        strobes += [found.sol(one) for one in asked if t < one <= found.t[-1]]
        t, y = float(found.t[-1]), found.y[:, -1].copy()
        if found.status == 1:
            push = (1.0 + restitution) * (y[3] - y[1]) * mass / (1.0 + mass)
            y += [0.0, push, 0.0, -push / mass]
    places = np.array(strobes)[:, ::2]
    return float(np.abs(places[-1] - places[-2]).max() / play)


@pytest.mark.parametrize(
    ("mass", "play", "restitution", "force", "frequency"),
    [(0.1, 10e-3, 0.6, 5.0, 15.9), (0.1, 10e-3, 0.3, 6.0, 16.3), (0.2, 8e-3, 0.4, 6.0, 15.5)],
)
@pytest.mark.parametrize("steps", [1280, 1283.7])
def test_impacts_that_repeat_do_so_at_any_step(
    mass: float, play: float, restitution: float, force: float, frequency: float, steps: float, tmp_path: Path
) -> None:
    main, ball = gb.mass(1.0, stiffness=K, damping=C, name="main"), gb.mass(mass, name="ball")
    box = gb.Contact((ball["at"], main["at"]), gb.Slot(play), gb.Unilateral(restitution), name="box")
    shaker = gb.Force(main["at"], lambda t: force * np.cos(2.0 * pi * frequency * t))
    period = 1.0 / frequency
    h = period / steps
    outcome = gb.run(
        gb.Scene(main, ball, contacts=[box], loads=[shaker]), step=h, end=round(CYCLES * period / h) * h,
        period=period, errors=False, output=tmp_path / "run",
    )  # fmt: skip
    history: xr.Dataset = gb.open_results(tmp_path / "run").history
    assert outcome.exit_status == 0
    assert repeats(mass, play, restitution, force, frequency) < 1e-6
    found = steady(history, frequency)
    assert found.cycle.residual < 5e-3  # to the step that an impact falls in
    for names in (found.quantities, figures_of_record(history)[0]):
        assert not [name for name in names if "force" in name]
        assert any("impulse" in name for name in names)
