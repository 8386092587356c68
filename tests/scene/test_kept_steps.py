"""Steps of a march that are kept: values of another time are refused, numbers and states stay."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import gapbeam as gb

Read = Callable[[Any], Any]
READ: list[Read] = [
    lambda step: step["at"].displacement, lambda step: step.contacts["stop"].force, lambda step: step.energy,
    lambda step: step.balance, lambda step: step.work, lambda step: step.state,
]  # fmt: skip


def oscillator(large: bool = False) -> gb.Scene:
    """A mass that falls on a stop; large: beside many others."""
    count = 700 if large else 1
    body = gb.Structure(np.eye(count), 100.0 * np.eye(count), points={"at": 0}, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(1e-3), gb.KelvinVoigt(1e4), name="stop")
    return gb.Scene(body, contacts=[stop], loads=[gb.Force(body["at"], 1.0)])


@pytest.mark.parametrize("read", READ)
@pytest.mark.parametrize("large", [False, True])
def test_a_step_that_is_over_has_no_values(large: bool, read: Read) -> None:
    steps = list(gb.march(oscillator(large), 1e-3, 0.05))
    assert [step.t for step in steps] == pytest.approx(1e-3 * np.arange(1, 51))
    read(steps[-1])
    for step in steps[:-1]:
        with pytest.raises(gb.UserError, match="expected the present step"):
            read(step)


def test_numbers_and_states_of_a_step_stay() -> None:
    """Those of a loop are those of the history."""
    scene, kept = oscillator(), list[tuple[float, Any]]()
    for step in gb.march(scene, 1e-3, 0.05):
        kept.append((step["at"].displacement, step.state))
    whole = gb.history(scene, 1e-3, 0.05)
    assert np.array([x for x, _ in kept]) == pytest.approx(whole.displacement["at"], rel=1e-12)
    assert np.array([state.q[0, 0] for _, state in kept]) == pytest.approx(whole.displacement["at"], rel=1e-12)
    assert whole.last["at"].displacement == whole.displacement["at"][-1]
