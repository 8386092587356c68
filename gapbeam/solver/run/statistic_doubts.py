"""Doubts on the statistics of a run: impacts that its steps missed, and the bias of its scheme."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.impact_list import DURATION
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.block_means import missed_share
from gapbeam.solver.diagnostics.statistics.statistic_figures import LEAST, Doubts, energy_bias
from gapbeam.solver.integrators.noise_bias import bias_at
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.stop_rule import has_statistics


def doubts_of(model: Model, accounts: Accounts) -> Doubts:
    """Return the doubts on the statistics of a march."""
    time = model.case.time
    step = accounts.tally.shortest if time.adaptive else model.step
    ended = dict(zip(model.system.contact.face_names, accounts.impacts.ended, strict=True))
    noise, struck = has_statistics(model.case), model.system.contact.slip_modes.impact_time
    return Doubts(
        {face: missed_share(one, step) for face, one in ended.items()},
        energy_bias(accounts.ledger) if noise else 0.0,
        {face: float(np.median(one.rows[:, DURATION])) / step for face, one in ended.items() if one.count},
        time.scheme.measured_bias if noise else (),
        struck / step if struck > 0.0 else inf,
    )


def noise_remarks(model: Model) -> Iterator[str]:
    """Yield a warning of energy that the scheme, in its step, adds to or takes from a motion under noise."""
    case = model.case
    if not has_statistics(case):
        return
    steps = model.contact_duration / shortest_step(case)
    row = bias_at(case.time.scheme.measured_bias, steps)
    if row is not None and abs(row.mean_square) > LEAST:
        side = "low" if row.mean_square < 0.0 else "high"
        yield (
            f"[time.scheme] {case.time.scheme.type} under random loads: with {steps:.2g} steps in a contact of "
            f"{model.contact_duration:.2g} s, the shortest one, the mean square of a rattling mass is "
            f"{abs(row.mean_square):.0%} {side} and its mean contact force {row.mean_force:+.0%} off; longer contacts "
            "and more damping make that less, which the run measures; the scheme discrete-gradient changes none"
        )


def shortest_step(case: Case) -> float:
    """Return the shortest step of a case, s; its step is known."""
    assert case.time.step != "auto"
    return case.time.step / 2**case.time.max_halvings if case.time.adaptive else case.time.step
