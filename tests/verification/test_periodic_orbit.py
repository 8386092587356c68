"""A bilinear oscillator on its periodic orbit: state, harmonics and largest force to their digits.

x'' + 2 zeta x' + x + kc <x - g> = F cos(Omega t), zeta = 0.05, F = 1, Omega = 0.8, g = 0.5, kc = 100.
Source: matrix exponential in each phase with root finding for the touches (independent of gapbeam).
"""

from __future__ import annotations

from math import cos, pi

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from tests.shared.toys import SCHEMES, start, steps_of, stopped_oscillator

STATE = 0.621960005279, -1.441042235106
MEAN = -0.4896932698
HARMONICS = 0.1984560650, 0.6207269479, 0.2026806715, 0.1033639572, 0.062810531
LARGEST_FORCE = 19.03880302
PERIOD = 2.0 * pi / 0.8


@pytest.mark.slow(minutes=0.1)
def test_orbit_returns() -> None:
    """One period from the known state leads back to it, with order 2; Richardson's limit to 2e-6."""
    ends, means, harmonics, forces = [], [], [], []
    for count in (4000, 8000):
        system = stopped_oscillator(1.0, 1.0, 0.5, 0.05, lambda t: cos(0.8 * t))
        steps = steps_of(
            system, kelvin_voigt(100.0), SCHEMES["discrete-gradient"], start(system, *STATE), PERIOD / count, count
        )
        x = np.array([STATE[0], *(step.new.u[0, 0] for step in steps)])[:-1]
        ends.append(np.array([steps[-1].new.u[0, 0], steps[-1].new.v[0, 0]]))
        spectrum = np.fft.rfft(x) / count
        means.append(spectrum[0].real)
        harmonics.append(2.0 * np.abs(spectrum[1:6]))
        forces.append(max(step.stage.pressure[0] for step in steps))
    errors = [np.max(np.abs(end - STATE)) for end in ends]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    assert (4.0 * ends[1] - ends[0]) / 3.0 == pytest.approx(STATE, abs=2e-6)
    assert (4.0 * means[1] - means[0]) / 3.0 == pytest.approx(MEAN, abs=1e-6)
    assert (4.0 * harmonics[1] - harmonics[0]) / 3.0 == pytest.approx(HARMONICS, abs=1e-6)
    assert forces[1] == pytest.approx(LARGEST_FORCE, rel=2e-5)
