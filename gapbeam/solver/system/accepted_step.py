"""One accepted step of a march, and the balance that it satisfied."""

from __future__ import annotations

from dataclasses import dataclass, field

from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import Imaged, State


@dataclass(frozen=True)
class Stage:
    """The balance that a step satisfied: what the energy ledger needs to know.

    Attributes:
        load_factors: s_k in the balance.
        inertia_and_elastic: M a + K u as they stood in the balance, (n,), N.
        velocity: Velocity in the damping term, with images, (3, n).
        pressure: Contact pressure in the balance, (m,), Pa.
        elastic_pressure: Its part that derives from the contact potential, (m,), Pa.
        traction: Tangential traction of friction in the balance, (m, k), Pa; None: without friction.
        unresolved: Work of contact forces that round-off in the contact solve hides, J.
        opening: Directions in which the stations in round holes opened their gaps, (k, 2); None: none turn.
    """

    load_factors: Array
    inertia_and_elastic: Array
    velocity: Imaged
    pressure: Array
    elastic_pressure: Array
    traction: Array | None = None
    unresolved: float = 0.0
    opening: Array | None = None


@dataclass(frozen=True, repr=False)
class Step:
    """One accepted step.

    Attributes:
        old: State at its start.
        new: State at its end.
        stage: The balance that held.
        iterations: Iterations of the contact solve.
        completes: False for a part of a halved step that leaves a rest to do.
        failures: Attempts right before it that did not converge and were halved.
        refinements: Attempts right before it that did not resolve the contact and were halved.
        unresolved: Whether it does not resolve the contact either, at the limit of halvings.
        refreshed: `new` with its images formed anew by products with M and K, when that was due.
        timings: Wall time of parts of the step, s.
    """

    old: State
    new: State
    stage: Stage
    iterations: int
    completes: bool = True
    failures: int = 0
    refinements: int = 0
    unresolved: bool = False
    refreshed: State | None = None
    timings: dict[str, float] = field(default_factory=dict)

    @property
    def size(self) -> float:
        """Step size, s."""
        return self.new.time - self.old.time

    def __repr__(self) -> str:
        return f"<Step to {self.new.time:.6g} s: {self.size:.4g} s, {self.iterations} contact iterations>"
