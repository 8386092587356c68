"""A scheme of two stages a step, added from outside: its order against closed forms, its ledger, its traits."""

from __future__ import annotations

import itertools
from math import cos, pi, sin, sqrt

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.integrators.time_scheme import kernel_of
from gapbeam.solver.system.semi_discrete import VALUE
from tests.programs.made_up_composite import CompositeScheme
from tests.shared.toys import ledger_of, start, steps_of, stopped_oscillator

SCHEME = CompositeScheme(type="tr-bdf2")
RATIOS = (1, 2, 4, 8)


def orders(errors: list[float]) -> list[float]:
    """Return the observed orders of errors at steps that are halved."""
    return [float(np.log2(one / other)) for one, other in itertools.pairwise(errors)]


@pytest.mark.parametrize("size", [2.0**-10, 1.0, 2.0**10])
def test_free_and_forced_motion_is_of_second_order(size: float) -> None:
    """A mass on a spring under a constant and a harmonic force, at rest first: closed form, in every unit of time."""
    frequency, forcing = 2.0 * pi / size, 1.3 / size
    system = stopped_oscillator(1.0, frequency**2, gap=1.0e9, force=lambda t: sin(forcing * t))
    end, errors = 1.7 * size, []
    exact = (sin(forcing * end) - forcing / frequency * sin(frequency * end)) / (frequency**2 - forcing**2)
    for ratio in RATIOS:
        steps = steps_of(system, kelvin_voigt(1.0), SCHEME, start(system), end / 40 / ratio, 40 * ratio)
        errors.append(abs(float(steps[-1].new.u[VALUE][0]) - exact))
    assert errors[-1] < 1.0e-3 * abs(exact)
    assert min(orders(errors)) > 1.9, errors


def test_permanent_contact_is_of_second_order() -> None:
    """A mass pressed against a stop: the spring of the stop is marched as one, d = d0 cos(w t)."""
    system, law = stopped_oscillator(1.0, 0.0, gap=-1.0), ContactLaw(Spring(4.0))
    errors = []
    for ratio in RATIOS:
        steps = steps_of(system, law, SCHEME, start(system), 0.7 / 20 / ratio, 20 * ratio)
        errors.append(abs(float(steps[-1].new.depth[0]) - cos(2.0 * 0.7)))
    assert min(orders(errors)) > 1.8, errors


def test_a_bounce_converges_and_its_ledger_closes() -> None:
    """A mass meets a stop at speed 1 and leaves it after half a period; what the scheme creates fades."""
    system, law = stopped_oscillator(1.0, 0.0, gap=0.1), ContactLaw(Spring(1.0e2))
    off, late = [], []
    for ratio in RATIOS:
        begin = start(system, 0.0, 1.0)
        steps = steps_of(system, law, SCHEME, begin, 0.01 / ratio, 60 * ratio)
        ledger, last = ledger_of(system, law, begin, steps), steps[-1].new
        assert abs(ledger.residual) < 1.0e-9 * ledger.exchanged
        off.append(abs(0.5 - ledger.kinetic))
        back = 0.6 - 0.1 - pi / sqrt(1.0e2)  # s since it left the stop, by the closed form
        late.append(abs(float(last.u[VALUE][0]) - (0.1 - back)))
    assert off[-1] < 1.0e-3
    assert off[-1] < 0.3 * max(off)
    assert SCHEME.creates_energy
    assert late[-1] < 0.1 * max(late)


@pytest.mark.parametrize("angle", [1.0e-3, 0.3, 3.0, 1.0e4])
def test_the_matrix_of_a_step_is_that_of_the_march(angle: float) -> None:
    """Column by column, on an oscillator; what is fast is gone after a step."""
    system = stopped_oscillator(1.0, angle**2, gap=1.0e9)
    columns = []
    for place, speed in ((1.0, 0.0), (0.0, 1.0)):
        [step] = steps_of(system, kelvin_voigt(1.0), SCHEME, start(system, place, speed), 1.0, 1)
        columns.append([step.new.u[VALUE][0], step.new.v[VALUE][0]])
    matrix = SCHEME.amplification(angle)
    assert pytest.approx(matrix, rel=1.0e-9, abs=1.0e-9 * float(np.abs(matrix).max())) == np.array(columns).T
    assert float(np.abs(np.linalg.eigvals(matrix)).max()) < (1.0 + 1.0e-12 if angle < 100.0 else 1.0e-3)


def test_no_kernel_marches_it() -> None:
    """It inherits the numbers of the midpoint rule, and takes another step."""
    assert kernel_of(SCHEME) is None
