"""Print how accurate periodic responses are: python3 docs/tables/periodic_table.py.

x'' + 0.1 x' + x + 100 <x - 0.5> = cos(0.8 t); source of the known figures: tests/verification/test_periodic_orbit.py.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from gapbeam.solver.periodic.harmonic_continuation import climb
from gapbeam.solver.periodic.shooting import shoot
from tests.verification.test_periodic_orbit import HARMONICS, STATE
from tests.verification.test_shooting import MULTIPLIER, oscillator_map, physical

START = np.array([0.6, -1.4])


def shooting() -> None:
    """Print errors of the orbit over the number of steps, and of Richardson's limit of two of them."""
    print("| steps N | error of the state | of harmonics 1-5 | of the multiplier | limit | iterations | time |")
    print("|---|---|---|---|---|---|---|")
    before = None
    shoot(oscillator_map(50), START)  # compile
    for steps in (250, 500, 1000, 2000, 4000, 8000, 16000):
        period_map = oscillator_map(steps)
        clock = time.perf_counter()
        orbit = shoot(period_map, START, 1.0e-10)
        seconds = time.perf_counter() - clock
        state = physical(period_map, orbit.x)
        places, _ = period_map.history(orbit.x)
        harmonics = 2.0 * np.abs(np.fft.rfft(places[:-1, 0])[1:6]) / steps
        limit = "" if before is None else f"{np.max(np.abs((4.0 * state - before) / 3.0 - STATE)):.1e}"
        print(
            f"| {steps} | {np.max(np.abs(state - STATE)):.1e} | {np.max(np.abs(harmonics - HARMONICS)):.1e} | "
            f"{abs(orbit.stability.largest - MULTIPLIER):.1e} | {limit} | {orbit.iterations} | {1e3 * seconds:.0f} ms |"
        )
        before = state


def balance() -> None:
    """Print errors of the orbit over the number of harmonics, from a cold start."""
    print("| harmonics H | error of harmonics 1-5 | force beyond H | residual | iterations | time |")
    print("|---|---|---|---|---|---|")
    for harmonics in (5, 10, 20, 40, 80, 160, 320):
        period_map = oscillator_map(50)
        clock = time.perf_counter()
        found = climb(period_map.modal, period_map.law, 0.8, harmonics)
        seconds = time.perf_counter() - clock
        found_amplitudes = found.solution.series.amplitudes(found.solution.coordinates)[:5, 0]
        iterations = sum(stage.iterations for stage in found.stages)
        print(
            f"| {harmonics} | {np.max(np.abs(found_amplitudes - HARMONICS)):.1e} | {found.solution.truncated:.1%} | "
            f"{found.solution.residual:.0e} | {iterations} | {1e3 * seconds:.0f} ms |"
        )


if __name__ == "__main__":
    shooting()
    print()
    balance()
