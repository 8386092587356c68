"""The bias of figures of rattling in the step, against the exact stationary law of a mass with one stop."""

from __future__ import annotations

from math import hypot

import pytest

from gapbeam.solver.integrators.scheme_choice import USUAL, scheme_of
from tests.shared.masses_under_noise import Biases, biases_of, exact_figures
from tests.shared.rattlers import between_stops

COARSE, SHORT, LONG = 2, 6400.0, 20000.0  # steps in a contact, s
SURE = 3.0  # standard errors


def test_both_integrals_of_the_law_agree() -> None:
    """With those that other tests of rattling are held to."""
    one, other = between_stops(1).exact, exact_figures()
    assert other["mean force"] == pytest.approx(one["face.upper.mean_force"], rel=1e-9)
    assert other["contact share"] == pytest.approx(one["face.upper.contact_share"], rel=1e-9)
    assert other["mean square force"] == pytest.approx(one["face.upper.rms_force"] ** 2, rel=1e-9)
    assert other["impact rate"] == pytest.approx(one["face.upper.impact_rate"], rel=1e-9)
    assert other["mean square"] - other["mean force"] ** 2 == pytest.approx(one["probe.mass.rms"] ** 2, rel=1e-9)


def of_second_order(seconds: float, steps: int) -> dict[str, tuple[float, float]]:
    """Return the bias of half the step less a quarter of that of the whole step, and its standard error, by figure."""
    whole, half = (biases_of(USUAL, count, seconds, seed=count) for count in (steps, 2 * steps))
    return {
        name: (half.relative[name] - 0.25 * whole.relative[name], hypot(half.errors[name], 0.25 * whole.errors[name]))
        for name in whole.relative
    }


def test_the_bias_of_the_usual_scheme_is_of_second_order() -> None:
    """A quarter is left at half the step, within chance and a few percent for the next order."""
    for name, (left, error) in of_second_order(SHORT, COARSE).items():
        assert abs(left) < SURE * error + 0.025, name


@pytest.mark.slow(minutes=2)
def test_the_bias_of_the_usual_scheme_is_of_second_order_on_long_records() -> None:
    """From a quarter of a contact on: within 1.5 %, and what is left at a sixteenth within 1 %."""
    for name, (left, error) in of_second_order(LONG, 4).items():
        assert abs(left) < SURE * error + 0.015, name
    fine = biases_of(USUAL, 16, LONG)
    assert all(abs(found) < SURE * fine.errors[name] + 0.01 for name, found in fine.relative.items())


def test_an_endpoint_law_takes_energy_at_impacts() -> None:
    """Chance leaves less than what parts schemes: the implicit midpoint rule is off by a fifth and more."""
    found: Biases = biases_of(scheme_of("implicit-midpoint"), 4, SHORT)
    assert found.relative["mean square"] < -0.15
    assert found.errors["mean square"] < 0.02
