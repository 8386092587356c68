"""Rattling under white noise against its exact stationary law: figures, and how often their intervals hold them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from tests.shared.rattlers import STIFFNESS, TEMPERATURE, Rattler, between_stops, in_a_hole, marched, sliding_on_a_stop

SECONDS, SEEDS, MANY = 600.0, 12, 100
STOPS = {"one stop": lambda: between_stops(1), "two stops": lambda: between_stops(2)}
RATTLERS = {**STOPS, "round hole": in_a_hole, "sliding": sliding_on_a_stop}  # made by calls: their integrals take 3 s


def test_the_exact_law_of_a_mass_without_stops() -> None:
    """What the integrals are checked by: the law at its known limits, a Gaussian share beyond the gap."""
    soft = quad(lambda x: np.exp(-0.5 * x * x), 1.0, 8.0)[0] / quad(lambda x: np.exp(-0.5 * x * x), -8.0, 8.0)[0]
    one, two = RATTLERS["one stop"]().exact, RATTLERS["two stops"]().exact
    assert one["face.upper.contact_share"] < soft
    assert two["face.upper.mean_force"] == pytest.approx(two["face.lower.mean_force"], rel=1e-9)
    # the balance of the mean: k E u = - E N (one stop); equipartition: E u dU/du = T (two stops)
    bounced = two["probe.mass.rms"] ** 2
    share, force = two["face.upper.contact_share"], two["face.upper.mean_force"]
    pressed = quad(lambda d: d * d * np.exp(-(0.5 * (1 + d) ** 2 + 0.5 * STIFFNESS * d * d) / TEMPERATURE), 0, 4)[0]
    whole = quad(lambda d: np.exp(-(0.5 * (1 + d) ** 2 + 0.5 * STIFFNESS * d * d) / TEMPERATURE), 0, 4)[0]
    virial = bounced + 2.0 * (force + STIFFNESS * share * pressed / whole)
    assert virial == pytest.approx(TEMPERATURE, rel=1e-6)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", RATTLERS)
def test_marches_have_the_exact_figures(name: str) -> None:
    """Means of twelve signals lie within three standard errors and 2 % for the step; most intervals hold."""
    rattler = RATTLERS[name]()
    found = [figures(rattler, seed, SECONDS) for seed in range(SEEDS)]
    held = []
    for figure, exact in rattler.exact.items():
        low, value, high = np.mean([one[figure] for one in found], axis=0)
        error = 0.5 * (high - low) / 1.96 / np.sqrt(SEEDS)
        assert abs(value - exact) < 3.0 * error + 0.02 * exact, figure
        held += [one[figure][0] <= exact <= one[figure][2] for one in found]
    assert np.mean(held) >= 0.8


@pytest.mark.slow
@pytest.mark.parametrize("name", [*STOPS, "sliding"])
def test_intervals_hold_the_exact_figures(name: str) -> None:
    """Of the intervals of 100 signals at least 87 % hold each exact figure (chance, the step), and 92 to 99 % all."""
    rattler = RATTLERS[name]()
    found = [figures(rattler, seed, SECONDS) for seed in range(MANY)]
    shares = {
        figure: np.mean([one[figure][0] <= exact <= one[figure][2] for one in found])
        for figure, exact in rattler.exact.items()
    }
    assert all(share >= 0.87 for share in shares.values()), shares
    assert 0.92 <= np.mean(list(shares.values())) <= 0.99, shares
    for figure, exact in rattler.exact.items():  # 3 standard deviations of chance, and the step
        assert np.mean([one[figure][1] for one in found]) == pytest.approx(exact, rel=0.05), figure


def figures(rattler: Rattler, seed: int, seconds: float) -> dict[str, tuple[float, float, float]]:
    """Return low end, value and high end of every figure of a march."""
    marched_figures = marched(rattler, seed, seconds).figures()
    return {one.name: (one.interval.low, one.interval.value, one.interval.high) for one in marched_figures}
