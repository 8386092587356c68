"""Order in time with contact: 2 where the pressure is continuous; 1 where damping makes it jump at touch.

A mass on a spring bounces against a stop twice; errors against a fine solution over five levels, six
where the pressure jumps. Where a jump falls in
a step is chance, so errors of Kelvin-Voigt are taken over several gaps. The discrete gradient takes the mean of the
damping over the part of the step that is spent in contact, and keeps order 2 even there.

Source of the expected orders: the truncation error at a kink (2) and at a jump (1) of the force.
"""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.contact.laws.springs import Spring
from tests.shared.toys import SCHEMES, start, steps_of, stopped_oscillator

END, COARSEST = 4.0, 150
SPRING = Spring(400.0, 1.5)
ELASTIC, HUNT_CROSSLEY = kelvin_voigt(50.0), ContactLaw(SPRING, Damper("hunt-crossley", 0.8))
KELVIN_VOIGT = kelvin_voigt(50.0, 4.0)


def order(law: ContactLaw, name: str, gaps: tuple[float, ...] = (0.1,), levels: int = 5) -> float:
    """The slope of log error over log step, fitted over all levels."""
    errors = np.zeros(levels)
    counts = [COARSEST * 2**level for level in range(levels)]
    for gap in gaps:
        system = stopped_oscillator(1.0, 1.0, gap)
        ends = []
        for count in (*counts, 4 * counts[-1]):
            end = steps_of(system, law, SCHEMES[name], start(system, v=1.0), END / count, count)[-1].new
            ends.append(np.array([end.u[0, 0], end.v[0, 0]]))
        errors += np.linalg.norm(np.array(ends[:-1]) - ends[-1], axis=1) ** 2
    return float(-0.5 * np.polyfit(np.log(counts), np.log(errors), 1)[0])


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("law", [ELASTIC, HUNT_CROSSLEY], ids=["elastic", "hunt-crossley"])
@pytest.mark.parametrize("name", ["discrete-gradient", "newmark", "generalized-alpha"])
def test_continuous_pressure_keeps_order_two(law: ContactLaw, name: str) -> None:
    """Elastic and Hunt-Crossley contact: 2 within 0.15."""
    assert order(law, name) == pytest.approx(2.0, abs=0.15)


@pytest.mark.slow(minutes=0.2)
def test_explicit_damping_lags_by_half_a_step() -> None:
    """Central difference: 2 within 0.15 on elastic contact; 1 within 0.25 where the law takes the rate of the step."""
    assert order(ELASTIC, "central-difference") == pytest.approx(2.0, abs=0.15)
    assert order(HUNT_CROSSLEY, "central-difference") == pytest.approx(1.0, abs=0.25)


@pytest.mark.slow
def test_discrete_gradient_keeps_order_two_with_a_jump() -> None:
    """Kelvin-Voigt with the time mean of its damping: 2 within 0.2."""
    assert order(KELVIN_VOIGT, "discrete-gradient", (0.1, 0.1037, 0.1083), 6) == pytest.approx(2.0, abs=0.2)


@pytest.mark.slow
def test_pressure_that_jumps_costs_an_order() -> None:
    """Kelvin-Voigt evaluated at the end of the step: 1 within 0.25."""
    gaps = (0.1, 0.1013, 0.1037, 0.1059, 0.1083)
    assert order(KELVIN_VOIGT, "newmark", gaps, 6) == pytest.approx(1.0, abs=0.25)
