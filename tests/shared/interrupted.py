"""Runs that are stopped after a number of steps or fields, in the process of the test."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.march import simulation as gathered_steps
from gapbeam.solver.march.compiled.compiled_march import CompiledBlock, CompiledLoop
from gapbeam.solver.march.stepwise_march import Paused
from gapbeam.solver.run.interruption import Interruption, Wish
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.system.semi_discrete import State


@contextmanager
def stopped_after(step_blocks: int, wish: Wish = Wish.TERMINATE) -> Iterator[None]:
    """End the runs within, as a signal would, after so many steps, or fields where the march is compiled."""
    passed, blocks = 0, CompiledLoop.blocks

    def from_field_to_field(
        loop: CompiledLoop, start: State | Paused, every: int, *given: Any, between_snapshots: int, **others: Any
    ) -> Iterator[CompiledBlock]:
        others |= {"stops": between_snapshots, "between_snapshots": between_snapshots}
        return blocks(loop, start, every, *given, **others)

    def agreed(_self: Interruption, own: Wish = Wish.NONE) -> Wish:
        nonlocal passed
        passed += 1
        return max(own, wish) if passed >= step_blocks else own

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Interruption, "agreed", agreed)
        patch.setattr(gathered_steps, "MOST_STEPS", 1)
        patch.setattr(CompiledLoop, "blocks", from_field_to_field)
        yield


def run_in_parts(case: Path, overrides: Sequence[str], folder: Path, stops: Sequence[int]) -> Outcome:
    """Run a case that is stopped after so many steps or fields, continues, and is stopped again."""
    for number, stop in enumerate(stops):
        with stopped_after(stop):
            outcome = gapbeam.run(case, overrides, folder, resume=number > 0)
        assert (outcome.exit_status, outcome.summary["status"]) == (143, "interrupted"), outcome.message
    return gapbeam.run(case, overrides, folder, resume=True)


def differing(one: Path, other: Path) -> list[str]:
    """Return what differs between two runs, to the last bit: histories, fields and figures."""
    first, second = open_results(one), open_results(other)
    found = [name for name in first.history.variables if not first.history[name].equals(second.history[name])]
    with first.fields() as fields, second.fields() as others:
        pairs = list(zip(fields, others, strict=True))
    found += [
        f"{name} at {frame.time}"
        for frame, same in pairs
        for name in ("time", "displacement", "velocity", "contact_pressure")
        if not np.array_equal(getattr(frame, name), getattr(same, name))
    ]
    found += [
        f"{name} at {frame.time}"
        for frame, same in pairs
        for name in frame.stress
        if not np.array_equal(frame.stress[name], same.stress[name])
    ]
    figures = ("energy", "gates", "contact_episodes", "convergence", "peak_contact_force", "penetration", "restraint")
    return found + [name for name in figures if first.summary[name] != second.summary[name]]
