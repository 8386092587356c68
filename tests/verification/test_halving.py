"""A step whose contact solve does not converge is halved; at the limit the run says when, where and what to try."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.contact.solve import contact_solve
from gapbeam.solver.integrators.midpoint import DiscreteGradient
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem, State, Step
from tests.shared.models import COARSE, beam_model, thrown
from tests.shared.toys import ledger_of, start, stopped_oscillator

STEP = 2.0**-6  # s, so that halves and sums are exact


class Fussy(DiscreteGradient):
    """The midpoint rule, refusing steps above a size within a span of time."""

    first: float = 5.0 * STEP
    last: float = 8.0 * STEP
    largest: float = 0.25 * STEP

    def advance(
        self, system: SemiDiscreteSystem, condensed, law, old: State, dt: float, max_iterations: int = 60
    ) -> Step:
        """Advance, or refuse."""
        if self.first <= old.time < self.last and dt > self.largest:
            raise NotConverged("refused")
        return super().advance(system, condensed, law, old, dt, max_iterations)


class Counting(EffectiveOperators):
    """Effective operators that count what they were asked for."""

    def __init__(self, system: SemiDiscreteSystem, scheme: TimeScheme) -> None:
        super().__init__(system, scheme)
        self.asked: list[tuple[float, int]] = []

    def at(self, dt: float):
        """Return the condensed operator of a step size, and note which one it was."""
        condensed = super().at(dt)
        self.asked.append((dt, id(condensed)))
        return condensed


def test_refused_steps_are_halved_and_whole_again_afterward() -> None:
    """Three steps refused twice become twelve quarters, every size is factored once, and the motion is theirs.

    Compared with steps taken by hand, quarters over these three and whole ones elsewhere.
    """
    system, law, scheme = stopped_oscillator(1.0, 4.0, 0.05, 0.02, np.sin), kelvin_voigt(1.0e3), Fussy()
    operators = Counting(system, scheme)
    steps = list(march(March(system, law, scheme, operators, STEP, 20), start(system, v=1.0)))
    sizes = np.array([step.size for step in steps]) / STEP
    assert sizes == pytest.approx(np.array([1.0] * 5 + [0.25] * 12 + [1.0] * 12), rel=1e-12)
    ends = [step.new.time / STEP for step in steps if step.completes]
    assert ends == list(range(1, 21))
    assert {dt for dt, _ in operators.asked} == {STEP, 0.5 * STEP, 0.25 * STEP}
    assert len({made for _, made in operators.asked}) == 3
    state = start(system, v=1.0)
    for count, dt in ((5, STEP), (12, 0.25 * STEP), (12, STEP)):
        for _ in range(count):
            state = (
                scheme_of("discrete-gradient")
                .advance(system, EffectiveOperators(system, scheme).at(dt), law, state, dt)
                .new
            )
    assert steps[-1].new.u[0, 0] == pytest.approx(state.u[0, 0], rel=1e-13)
    assert max(step.new.depth[0] for step in steps) > 0.0


def test_beam_goes_on_with_half_steps() -> None:
    """A beam thrown at its gland, with 3 contact iterations where 5 are needed: halved, and the answer hardly changes.

    Whole steps end on time; the tip is within 0.1 % of the whole-step march after 60 steps; energy still balances.
    """
    model = beam_model({"mesh": COARSE}, probes={"tip": 0.51})
    system, scheme, law, first = model.system, scheme_of("discrete-gradient"), kelvin_voigt(5.0e11), thrown(model)
    marches = {}
    for limit in (60, 3):
        operators = EffectiveOperators(system, scheme)
        plan = March(system, law, scheme, operators, 1.0e-4, 60, max_iterations=limit)
        marches[limit] = list(march(plan, first))
    whole, halved = marches[60], marches[3]
    assert len(whole) == 60
    assert max(step.iterations for step in whole) > 3
    assert len(halved) > 60
    assert max(step.iterations for step in halved) <= 3
    times = [step.new.time for step in halved if step.completes]
    assert times == pytest.approx([step.new.time for step in whole], rel=1e-12)
    tips = [model.probes["tip"].evaluate(steps[-1].new.u[0], system.operators)[1] for steps in (whole, halved)]
    assert tips[1] == pytest.approx(tips[0], rel=1e-3)
    ledger = ledger_of(system, law, first, halved)
    assert abs(ledger.residual) < ledger.round_off < 1e-6 * ledger.largest_kinetic


def test_limit_of_halving_says_when_where_and_what_to_try() -> None:
    """One contact iteration is never enough to land: the error names time, step, face and point, and remedies."""
    model = beam_model({"mesh": COARSE})
    system, scheme = model.system, scheme_of("discrete-gradient")
    operators = EffectiveOperators(system, scheme)
    plan = March(system, kelvin_voigt(5.0e11), scheme, operators, 1.0e-4, 60, max_halvings=3, max_iterations=1)
    done: list[Step] = []
    with pytest.raises(NotConverged) as caught:
        done.extend(march(plan, thrown(model)))
    message = str(caught.value)
    for part in (
        "at t = 0.0005",
        "step of 1.25e-05 s",
        "halved 3 times",
        "at the gland, point (0.000",
        "in 1 iterations",
    ):
        assert part in message
    for remedy in ("smaller time.step", "more time.max_iterations", "softer contact"):
        assert remedy in message
    assert len(caught.value.residuals) == 2
    worst = caught.value.worst_point
    assert worst is not None
    assert system.contact.face_names[system.contact.faces[worst]] == "gland"
    assert caught.value.exit_status == 4


def test_multipliers_that_do_not_settle_have_remedies_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stiffer contact needs fewer updates; the message went on to ask for a softer one, and for less damping."""
    model = beam_model({"mesh": COARSE})
    system, scheme = model.system, scheme_of("implicit-midpoint")
    law = replace(kelvin_voigt(5.0e11), augmented=1.0e-9)
    plan = March(system, law, scheme, EffectiveOperators(system, scheme), 1.0e-4, 60, max_halvings=1)
    monkeypatch.setattr(contact_solve, "MOST_UPDATES", 0)
    with pytest.raises(NotConverged) as caught:
        list(march(plan, thrown(model)))
    assert "a stiffer contact, or a larger penetration in contact.formulation" in str(caught.value)
    assert not any(word in str(caught.value) for word in ("softer", "damping"))
