"""Counts of a march: its cost, and the convergence of its solves."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.semi_discrete import STIFFNESS

HALVED = 0.75  # of the step of the case; a step shorter than this is part of a halved one


@dataclass
class Tally:
    """Counts of a march, over its accepted steps.

    Attributes:
        dt: Step of the case, s.
        steps: Accepted steps, parts of halved steps included.
        halved: Parts of halved steps.
        failures: Steps that were halved because the contact solve did not converge.
        refinements: Steps that were halved because they did not resolve the contact.
        unresolved: Accepted steps that do not resolve the contact, at the limit of halvings.
        shortest: Shortest accepted step, s.
        iterations: Iterations of the contact solve.
        most_iterations: The most in one step.
        advance: Time in the steps themselves, s.
        back_substitution: Time in their back-substitutions, s.
        march: Time of the march with everything, output included, s.
        drift: Largest difference between the image K u that was carried and a new product, N.
        elastic_force: Largest entry of K u at these times, N.
    """

    dt: float
    steps: int = 0
    halved: int = 0
    failures: int = 0
    refinements: int = 0
    unresolved: int = 0
    shortest: float = inf
    iterations: int = 0
    most_iterations: int = 0
    advance: float = 0.0
    back_substitution: float = 0.0
    march: float = 0.0
    drift: float = 0.0
    elastic_force: float = 0.0

    def see(self, step: Step, seconds: float) -> None:
        """Count an accepted step that took some seconds."""
        self.steps += 1
        self.halved += step.size < HALVED * self.dt
        self.failures += step.failures
        self.refinements += step.refinements
        self.unresolved += step.unresolved
        self.shortest = min(self.shortest, step.size)
        self.iterations += step.iterations
        self.most_iterations = max(self.most_iterations, step.iterations)
        self.advance += seconds
        self.back_substitution += step.timings["back_substitution"]
        drift, force = image_drift(step)
        self.drift, self.elastic_force = max(self.drift, drift), max(self.elastic_force, force)

    def convergence(self) -> dict[str, Any]:
        """Return the counts for the summary."""
        return {
            "steps": self.steps,
            "parts_of_halved_steps": self.halved,
            "halvings_not_converged": self.failures,
            "halvings_adaptive": self.refinements,
            "unresolved_steps": self.unresolved,
            "shortest_step": self.shortest,
            "iterations_mean": self.iterations / max(self.steps, 1),
            "iterations_max": self.most_iterations,
            "image_drift": self.drift / self.elastic_force if self.elastic_force > 0.0 else 0.0,
        }

    def seconds(self) -> dict[str, float | None]:
        """Return the wall times for the summary."""
        count = max(self.steps, 1)
        per_step, back = self.march / count, self.back_substitution / count
        return {
            "march": self.march,
            "per_step": per_step,
            "advance": self.advance / count,
            "back_substitution": back,
            "step_over_back_substitution": per_step / back if back > 0.0 else None,
        }


def image_drift(step: Step) -> tuple[float, float]:
    """Return the drift of the image K u when it was refreshed, and the size of K u, N; local part."""
    if step.refreshed is None:
        return 0.0, 0.0
    kept, true = step.new.u[STIFFNESS], step.refreshed.u[STIFFNESS]
    return float(np.max(np.abs(kept - true), initial=0.0)), float(np.max(np.abs(true), initial=0.0))
