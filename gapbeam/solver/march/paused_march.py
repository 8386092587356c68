"""A march between two of its steps."""

from __future__ import annotations

from dataclasses import dataclass

from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State


@dataclass(frozen=True)
class Paused:
    """State of a march that its next step depends on, so that it continues to the same bits.

    Attributes:
        state: The state, as a march carries it along.
        done: Whole steps since the start.
        since: Steps, parts of halved ones included, since the images of the state were formed anew.
        modal: State of a compiled loop, see `compiled.compiled_march`; None: not compiled.
    """

    state: State
    done: int
    since: int = 0
    modal: tuple[Array, ...] | None = None
