"""The tangent of the compiled loop: differences of marches, the matrix exponential, and known multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.contact.laws.damper import Damper
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.integrators.scheme_choice import USUAL, scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March
from gapbeam.solver.system.semi_discrete import State, imaged
from tests.shared.dense_beams import dense_beam, thrown_start
from tests.shared.passages import followed
from tests.shared.toys import start, stopped_oscillator

HERTZ = Spring(2.0e5, 1.5)
LAWS = {
    "elastic": ContactLaw(Spring(1.0e4)),
    "hertz": ContactLaw(HERTZ),
    "kelvin-voigt": kelvin_voigt(1.0e4, 10.0),
    "kelvin-voigt adhesive": kelvin_voigt(1.0e4, 10.0, adhesive=True),
    "hunt-crossley": ContactLaw(HERTZ, Damper("hunt-crossley", 0.4)),
    "smooth step": ContactLaw(Spring(1.0e4), Damper("adams-impact", 20.0, (2.0e-3,))),
}
DT, STEPS = 1.0e-3, 60


def loop_of(law: ContactLaw, scheme: TimeScheme, seed: int) -> CompiledLoop:
    """Return the loop of a random body."""
    system = dense_beam(seed=seed)
    return CompiledLoop(March(system, law, scheme, EffectiveOperators(system, scheme), DT, STEPS))


def moved(loop: CompiledLoop, state: State, direction: np.ndarray) -> State:
    """Return a state with (q, v) changed in modal coordinates."""
    n, system = len(loop.modal.squares), loop.plan.system
    u, v = (state.u[0] + loop.modal.dofs(direction[:n]), state.v[0] + loop.modal.dofs(direction[n:]))
    depth = system.contact.depth(system.contact.interface.trace(u, system.operators))
    return replace(state, u=imaged(system.operators, u), v=imaged(system.operators, v), depth=depth)


def coordinates(loop: CompiledLoop, state: State) -> np.ndarray:
    """Return (q, v)."""
    return np.concatenate([loop.modal.coordinates(state.u[0]), loop.modal.coordinates(state.v[0])])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("implicit", [False, True])
def test_the_tangent_is_that_of_differences(law: str, implicit: bool) -> None:
    loop = loop_of(LAWS[law], scheme_of("implicit-midpoint" if implicit else "discrete-gradient"), seed=3)
    begin = thrown_start(loop.plan.system)
    end, monodromy = loop.tangent(begin)
    passage = followed(loop, begin, STEPS)
    assert np.count_nonzero(passage.forces.max(axis=1)) > STEPS // 4, "nothing touched"
    assert coordinates(loop, end) == pytest.approx(coordinates(loop, passage.end), rel=1e-9, abs=1e-12)
    random = np.random.default_rng(0)
    for _ in range(4):
        direction = random.standard_normal(monodromy.shape[1]) * np.repeat([0.02, 1.0], monodromy.shape[1] // 2)
        size = 1.0e-7
        ends = [
            coordinates(loop, followed(loop, moved(loop, begin, sign * size * direction), STEPS).end)
            for sign in (1, -1)
        ]
        difference = (ends[0] - ends[1]) / (2.0 * size)
        error = np.linalg.norm(monodromy @ direction - difference) / np.linalg.norm(difference)
        assert error < 2.0e-5


def test_without_contact_the_tangent_tends_to_the_matrix_exponential() -> None:
    """An oscillator out of reach of its stop: order two in the step."""
    errors = []
    for dt in (0.02, 0.01):
        system = stopped_oscillator(2.0, 8.0, 100.0, 0.05)
        plan = March(
            system,
            ContactLaw(Spring(1.0)),
            USUAL,
            EffectiveOperators(system, USUAL),
            dt,
            round(1.0 / dt),
        )
        loop = CompiledLoop(plan)
        _, monodromy = loop.tangent(start(system, 0.3, 0.1))
        exact = expm(np.array([[0.0, 1.0], [-4.0, -0.2]]))
        errors.append(np.abs(monodromy - exact).max())
    assert errors[1] < 1.0e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_on_a_closed_stop_the_tangent_is_the_power_of_a_midpoint_step() -> None:
    """A mass on a spring and a stop of together 54 N/m: (1 - h A / 2)^-1 (1 + h A / 2) to the power of 200."""
    system = stopped_oscillator(1.0, 4.0, -0.5)
    plan = March(
        system,
        ContactLaw(Spring(50.0)),
        USUAL,
        EffectiveOperators(system, USUAL),
        0.01,
        200,
    )
    _, monodromy = CompiledLoop(plan).tangent(start(system, -0.46, 0.05))
    half = 0.005 * np.array([[0.0, 1.0], [-54.0, 0.0]])
    step = np.linalg.solve(np.eye(2) - half, np.eye(2) + half)
    assert monodromy == pytest.approx(np.linalg.matrix_power(step, 200), rel=1e-9, abs=1e-9)


def test_what_has_no_tangent_is_refused() -> None:
    system = dense_beam()
    scheme = scheme_of("newmark")
    plan = March(system, LAWS["elastic"], scheme, EffectiveOperators(system, scheme), DT, STEPS)
    with pytest.raises(ValueError, match="midpoint rule"):
        CompiledLoop(plan).tangent(thrown_start(system))
