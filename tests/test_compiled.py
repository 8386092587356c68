"""The compiled loop against the generic march: the same numbers to round-off, step by step, with every figure."""

from __future__ import annotations

import numpy as np
import pytest

from solver.accounts import Accounts
from solver.analyses.transient import EffectiveOperators, March, begun, march
from solver.compiled.loop import CompiledLoop
from solver.contact.dampers import HuntCrossleyDamper, SmoothStepDamper
from solver.contact.law import ContactLaw, kelvin_voigt
from solver.contact.springs import Spring
from solver.integrators.generalized_alpha import GeneralizedAlpha
from solver.integrators.midpoint import Midpoint
from tests.dense_beams import dense_beam, thrown_start

SCHEMES = {
    "discrete-gradient": Midpoint(),
    "implicit-midpoint": Midpoint(implicit=True),
    "newmark": GeneralizedAlpha.newmark(),
    "hht": GeneralizedAlpha.hht(0.2),
    "generalized-alpha 0.5": GeneralizedAlpha.from_spectral_radius(0.5),
}
HERTZ = Spring(2.0e6, 1.5)
LAWS = {
    "elastic": ContactLaw(Spring(1.0e5)),
    "hertz": ContactLaw(HERTZ),
    "kelvin-voigt": kelvin_voigt(1.0e5, 30.0, touch_depth=1.0e-5),
    "kelvin-voigt adhesive": kelvin_voigt(1.0e5, 30.0, adhesive=True, touch_depth=1.0e-5),
    "hunt-crossley": ContactLaw(HERTZ, HuntCrossleyDamper(HERTZ, 0.4)),
    "hunt-crossley by restitution": ContactLaw(HERTZ, HuntCrossleyDamper(HERTZ, 0.0), touch_product=0.6),
    "smooth step": ContactLaw(Spring(1.0e5, 1.2), SmoothStepDamper(60.0, 2.0e-3)),
    "unlike points": ContactLaw(Spring(np.geomspace(1.0e4, 1.0e6, 12)), SmoothStepDamper(np.full(12, 9.0), 2.0e-3)),
}
STEPS = 200
TOUCHY = {"hunt-crossley by restitution": 1.0e-6}  # chi follows from touch speeds: slow touches magnify round-off
DT = 1.0e-3


def close(found: np.ndarray | float, expected: np.ndarray | float, relative: float = 1.0e-9) -> bool:
    """Whether two arrays agree relative to the largest entry."""
    scale = float(np.max(np.abs(expected), initial=1.0e-12))
    return bool(np.max(np.abs(np.asarray(found) - np.asarray(expected)), initial=0.0) <= relative * scale)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_loop_agrees_with_the_march(scheme: str, law: str) -> None:
    system, steps, relative = dense_beam(seed=len(law)), STEPS, TOUCHY.get(law, 1.0e-9)
    plan = March(system, LAWS[law], SCHEMES[scheme], EffectiveOperators(system, SCHEMES[scheme]), DT, steps)
    start = thrown_start(system)
    expected = Accounts.opened(system, LAWS[law], begun(plan, start), DT)
    places, forces = [], []
    for step in march(plan, start):
        expected.take(step)
        state = step.refreshed or step.new
        assert step.completes
        places.append(state.u[0])
        forces.append(system.contact.weights * state.pressure)
    passed = Accounts.opened(system, LAWS[law], begun(plan, start), DT)
    blocks = list(CompiledLoop(plan).blocks(start, accounts=passed, stops=70))
    assert {70, steps} <= set(np.cumsum([block.steps for block in blocks]))
    assert close(np.concatenate([block.u for block in blocks]), np.array(places), relative)
    sides = np.array([np.bincount(system.contact.faces, force, 2) for force in forces])
    assert np.count_nonzero(sides.max(axis=1)) > steps // 10, "nothing touched"
    assert close(np.concatenate([block.records.force for block in blocks]), sides, relative)
    end = blocks[-1].end
    assert close(end.u[0], state.u[0], relative)
    assert close(end.v[0], state.v[0], relative)
    assert close(end.pressure, state.pressure, relative)
    assert_same_accounts(passed, expected, relative)


def assert_same_accounts(found: Accounts, expected: Accounts, relative: float) -> None:
    """Every figure that is kept of a march is the same."""
    scale = expected.ledger.exchanged
    for name, value in vars(expected.ledger).items():
        if name == "round_off":
            continue  # an estimate, made in the coordinates that are computed with
        assert np.max(np.abs(getattr(found.ledger, name) - value)) <= relative * scale, name
    assert close(found.peaks.impulse, expected.peaks.impulse, relative)
    assert close(found.peaks.force, expected.peaks.force, relative)
    assert close(found.peaks.deepest, expected.peaks.deepest, relative)
    assert found.peaks.iterations <= expected.peaks.iterations
    assert found.gates.impacts == expected.gates.impacts
    assert found.gates.violations == expected.gates.violations
    assert found.gates.largest_growth == pytest.approx(expected.gates.largest_growth, rel=1e-6, abs=relative)
    assert found.gates.largest_loss == pytest.approx(expected.gates.largest_loss, rel=1e-6, abs=relative)
    assert found.episodes.figures() == pytest.approx(expected.episodes.figures(), rel=relative)
    assert found.tally.steps == expected.tally.steps
    assert found.tally.iterations == pytest.approx(expected.tally.iterations, rel=0.02, abs=3)
