"""The bias of figures of rattling in the step, against the exact stationary law of a mass with one stop."""

from __future__ import annotations

from math import hypot

import pytest

from gapbeam.solver.integrators.scheme_choice import USUAL, scheme_names, scheme_of
from gapbeam.solver.integrators.time_scheme import NoiseBias, bias_at
from tests.shared.masses_under_noise import FIGURES, Biases, biases_of, energy_bias_of, exact_figures
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
    """Return the bias of half the step less a quarter of the whole step's, and its standard error, by figure."""
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
    scheme = scheme_of("implicit-midpoint")
    found: Biases = biases_of(scheme, 4, SHORT)
    assert found.relative["mean square"] < -0.15
    assert found.errors["mean square"] < 0.02
    check_table(scheme.measured_bias, 4.0, found)


def check_table(table: tuple[NoiseBias, ...], steps: float, found: Biases) -> None:
    row = bias_at(table, steps)
    assert row is not None
    for name, expected in zip(FIGURES, row[1:], strict=True):
        assert abs(found.relative[name] - expected) < SURE * found.errors[name] + 0.01, name


@pytest.mark.slow(minutes=2)
@pytest.mark.parametrize("name", [name for name in scheme_names() if scheme_of(name).measured_bias])
def test_biases_that_runs_warn_of_are_those_of_marches(name: str) -> None:
    """In a row of the table, between two, and beyond the last one."""
    for steps in (2.0, 6.0, 24.0):
        check_table(scheme_of(name).measured_bias, steps, biases_of(scheme_of(name), steps, SHORT))


@pytest.mark.parametrize("steps", [4.0, 16.0])
def test_the_energy_that_a_scheme_takes_is_what_the_motion_lacks(steps: float) -> None:
    """A quarter and an eighth of the mean square of the velocity, within 2 %; the usual scheme takes none."""
    lacks, found = energy_bias_of(scheme_of("implicit-midpoint"), steps, 2000.0)
    assert found < -0.1
    assert found == pytest.approx(lacks, abs=0.02)
    assert energy_bias_of(USUAL, steps, 200.0)[1] == 0.0
