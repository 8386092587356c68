"""Steps in blocks: nothing is lost, whoever marches, and what fails is reported after what came before it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

import numpy as np
import pytest

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.diagnostics.history_rows import Instants, Recorder, Rows
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import MOST_STEPS, StepBlock, Wanted, step_blocks_of
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.semi_discrete import Snapshots, Step
from tests.shared.dense_beams import dense_beam, thrown_start

STEPS, DT = 150, 1.0e-4
SCHEME = scheme_of("implicit-midpoint")


class Columns:
    """Makes records of what is recorded of any system."""

    def rows(self, instants: Instants) -> Rows:
        """Return times, displacements and impulses."""
        return {"time": instants.times, "u": instants.u, "impulse": instants.impulse}


def plan_of() -> March:
    system = dense_beam(seed=3)
    law = kelvin_voigt(1.0e5, 30.0, touch_depth=1.0e-5)
    return March(system, law, SCHEME, EffectiveOperators(system, SCHEME), DT, STEPS, 0, 8)


def one_by_one(plan: March, steps: Iterator[Step], wanted: Wanted) -> Iterator[StepBlock]:
    accounts = Accounts.opened(plan.system, plan.law, thrown_start(plan.system), plan.dt)
    return step_blocks_of(steps, plan.steps, accounts, cast(Recorder, Columns()), wanted)


def test_steps_that_come_one_by_one_are_gathered() -> None:
    """Every third step is recorded, every fortieth and the last one shown; a block ends after step 55."""
    plan = plan_of()
    wanted = Wanted(3, ends=True, also=frozenset({55}), snapshots=40)
    blocks = list(one_by_one(plan, march(plan, thrown_start(plan.system)), wanted))
    assert sum(block.steps for block in blocks) == STEPS
    assert 1 < max(block.steps for block in blocks) <= MOST_STEPS
    assert 55 in [block.done for block in blocks]
    kept = [block.rows for block in blocks if block.rows is not None]
    times = np.concatenate([rows["time"] for rows in kept])
    np.testing.assert_allclose(times / DT, np.arange(3, STEPS + 1, 3))
    expected = [step.new for step in march(plan, thrown_start(plan.system))]
    assert np.array_equal(np.concatenate([rows["u"] for rows in kept]), [state.u[0] for state in expected[2::3]])
    impulses = np.concatenate([rows["impulse"] for rows in kept])
    assert np.all(np.diff(impulses, axis=0) >= 0.0)
    assert np.unique(impulses[:, 0]).size > 2, "each record has the accounts at its own time"
    shown = [block.snapshots for block in blocks if block.snapshots is not None]
    np.testing.assert_allclose(np.concatenate([of.times for of in shown]) / DT, [40, 80, 120, 150])


def test_compiled_snapshots_are_the_states_at_their_times() -> None:
    """Bits of one march and of one that comes back at every snapshot; those of the march in Python to round-off."""
    plan = plan_of()
    start = thrown_start(plan.system)
    taken = joined(CompiledLoop(plan), between_snapshots=40)
    apart = joined(CompiledLoop(plan), between_snapshots=40, stops=40)
    for one, other in zip(taken, apart, strict=True):
        assert np.array_equal(one, other)
    states = [step.new for number, step in enumerate(march(plan, start), 1) if number in (40, 80, 120, 150)]
    for one, expected in zip(taken, Snapshots.of_states(states), strict=True):
        np.testing.assert_allclose(one, expected, rtol=1e-7, atol=1e-9 * float(np.max(np.abs(expected))))


def joined(loop: CompiledLoop, between_snapshots: int, stops: int | None = None) -> Snapshots:
    """Return the snapshots of a march, recorded at its end only."""
    start = thrown_start(loop.plan.system)
    blocks = loop.blocks(start, loop.plan.steps, stops=stops, between_snapshots=between_snapshots)
    kept = [block.snapshots for block in blocks if block.snapshots is not None]
    return Snapshots._make(np.concatenate(columns) for columns in zip(*kept, strict=True))


def test_what_fails_is_reported_after_what_came_before() -> None:
    plan = plan_of()

    def failing() -> Iterator[Step]:
        for number, step in enumerate(march(plan, thrown_start(plan.system))):
            if number == 100:
                raise NotConverged("no further")
            yield step

    blocks: list[StepBlock] = []

    def keep() -> None:
        for block in one_by_one(plan, failing(), Wanted(1)):
            blocks.append(block)

    with pytest.raises(NotConverged, match="no further"):
        keep()
    assert sum(len(block.rows["time"]) for block in blocks if block.rows is not None) == 100
    assert blocks[-1].done == 100
